# SPDX-License-Identifier: Apache-2.0
"""Sessions as users meet them: files, cancellation, limits, wrong arguments."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
import time
import zipfile

import deltalux as dl
import numpy as np
import pytest
from deltalux.stored.snapshot import VERSION
from hypothesis import given, settings
from hypothesis import strategies as st
from processes import listen_to_interrupts
from rooms import box, room, samples_in, translation, turn
from session_files import read_parts, write_parts
from thoroughness import examples, slow


@pytest.fixture
def baked():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=4000, gather=64, threads=1, direct="sampled") as session:
        session.bake()
        yield session


# ---- other versions of the scene --------------------------------------------------------------


def test_a_bake_of_another_scene_keeps_all_edits():
    spare = dl.Material("spare glow", (0, 0, 0), emission=(4, 4, 4))
    scene = dl.scene.replace_scene(room(), materials=(*room().materials, spare))
    lamp = dl.Mesh(
        "standard lamp", *box((0.2, 0.2, 0.2)), "spare glow", pose=translation(0.2, 1, 0), movable=True
    )
    samples, options = samples_in(scene), {"paths": 4000, "gather": 64, "threads": 1}
    with dl.Session(scene, samples, **options) as session:
        session.bake()
        session.move("block", translation(0.4, 0.31, 0.2))
        session.update()
        session.dim("desk", 0.5)
        session.rebake(session.scene.with_mesh(lamp), session.samples)
        session.dim("standard lamp", 0.25)
        session.update()
        with dl.Session(scene.with_mesh(lamp), samples, **options) as other:
            other.move("block", translation(0.4, 0.31, 0.2))
            other.dim("desk", 0.5)
            other.bake()
            other.dim("standard lamp", 0.25)
            other.update()
            assert session.digest() == other.digest()


# ---- files ------------------------------------------------------------------------------------


@pytest.mark.parametrize("direct", [slow("paths"), "sampled"])
@pytest.mark.parametrize("segment_end", ["first", slow("bounded")])
def test_open_continues_where_save_stopped(tmp_path, direct, segment_end):
    scene = room()
    path = tmp_path / "room.dlx"
    options = {"paths": 4000, "gather": 64, "direct": direct, "segment_end": segment_end}
    with dl.Session(scene, samples_in(scene), **options) as session:
        session.bake()
        session.move("block", translation(-0.5, 0.5, 0.2) @ turn(0.4))
        session.remove("lamp")
        session.dim("ceiling", 0.5)
        session.update()
        session.save(path)
        with dl.Session.open(path) as opened:
            assert opened.digest() == session.digest()
            np.testing.assert_array_equal(opened.irradiance, session.irradiance)
            np.testing.assert_array_equal(opened.pose("block"), session.pose("block"))
            assert opened.poses["lamp"] is None
            frames = []
            for each in (session, opened):
                each.add("lamp")
                each.move("block", translation(0.4, 0.6, -0.3))
                frames.append(each.update())
            assert opened.digest() == session.digest()
            assert frames[1].retraced_segments == frames[0].retraced_segments < frames[0].scanned_segments / 2
            digest = opened.digest()
            opened.recompute()
            assert opened.digest() == digest
    assert [p.name for p in tmp_path.iterdir()] == ["room.dlx"]


def test_session_saved_before_its_bake(tmp_path):
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=1000, gather=64) as session:
        session.save(tmp_path / "a.dlx")
        session.bake()
        with dl.Session.open(tmp_path / "a.dlx") as opened:
            opened.bake()
            assert opened.digest() == session.digest()


def test_truncated_session_files_are_refused(baked, tmp_path):
    path, cut = tmp_path / "whole.dlx", tmp_path / "cut.dlx"
    baked.save(path)
    data = path.read_bytes()
    for share in (0, 0.01, 0.3, 0.7, 0.99):
        cut.write_bytes(data[: int(share * len(data))])
        with pytest.raises(dl.FormatError, match=r"cut\.dlx"):
            dl.Session.open(cut)


def test_damaged_session_files_are_refused(baked, tmp_path):
    path = tmp_path / "damaged.dlx"
    baked.save(path)
    data = bytearray(path.read_bytes())
    rng = np.random.default_rng(1)
    for place in rng.integers(0, len(data), 25):
        data[place] ^= 0x10
        path.write_bytes(data)
        data[place] ^= 0x10
        try:
            dl.Session.open(path).close()
        except dl.FormatError as error:
            assert "damaged.dlx" in str(error)


PATTERNS = (b"\xff", b"\x00", b"\x7f", None)  # None: random bytes


@pytest.mark.parametrize("patterns", [PATTERNS[:1], slow(PATTERNS)])
def test_hostile_session_files_are_refused_or_harmless(tmp_path, patterns):
    """Right checksums, wrong contents: an error, or a session that still answers and updates."""
    scene = room()
    whole, hostile = tmp_path / "whole.dlx", tmp_path / "hostile.dlx"
    with dl.Session(scene, samples_in(scene), paths=300, gather=16, threads=1) as session:
        session.bake()
        session.move("block", translation(-0.5, 0.5, 0.2))
        session.update(budget_ms=1e-6)
        session.save(whole)
    index, arrays = read_parts(whole)
    rng = np.random.default_rng(5)
    refused = harmless = 0
    for name in sorted(arrays):
        if not name.startswith("core/"):
            continue
        for pattern in patterns:
            data = bytearray(arrays[name].tobytes())
            if not data:
                continue
            for place in rng.integers(0, max(1, len(data) // 4), 3):
                value = rng.bytes(4) if pattern is None else pattern * 4
                data[4 * place : 4 * place + 4] = value[: len(data) - 4 * place]
            write_parts(hostile, index, arrays | {name: np.frombuffer(bytes(data), np.uint8)})
            try:
                opened = dl.Session.open(hostile)
            except dl.FormatError as error:
                assert "hostile.dlx" in str(error)
                refused += 1
                continue
            harmless += 1
            with opened:
                opened.move("block", translation(0.4, 0.6, -0.3))
                opened.update()
                assert np.isfinite(opened.irradiance).all()
                assert np.isfinite(opened.standard_error).all()
    assert refused > 25 * len(patterns)
    assert harmless > 0


def test_foreign_and_missing_files_are_refused(tmp_path):
    foreign = tmp_path / "foreign.dlx"
    with zipfile.ZipFile(foreign, "w") as archive:
        archive.writestr("deltalux.json", '{"format": "something else"}')
    with pytest.raises(dl.FormatError, match="foreign"):
        dl.Session.open(foreign)
    with pytest.raises(dl.FormatError, match="no such file"):
        dl.Session.open(tmp_path / "absent.dlx")


def test_devices_and_pipes_are_refused():
    for path in ("/dev/full", "/dev/zero"):
        with pytest.raises(dl.FormatError, match="a device or a pipe, expected a regular file"):
            dl.Session.open(path)


def test_another_version_is_refused(baked, tmp_path):
    path = tmp_path / "old.dlx"
    baked.save(path)
    with zipfile.ZipFile(path) as archive:
        entries = {name: archive.read(name) for name in archive.namelist()}
    entries["deltalux.json"] = entries["deltalux.json"].replace(b'"version": %d' % VERSION, b'"version": 99')
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name, content)
    with pytest.raises(dl.FormatError, match="99"):
        dl.Session.open(path)


# ---- cancellation -----------------------------------------------------------------------------


class Stopper:
    """A progress callback that says no from the n-th call on, and how often it was asked after that."""

    def __init__(self, calls: int) -> None:
        self.left, self.asked_again, self.stages = calls, 0, set()

    def __call__(self, stage, fraction):
        assert 0 <= fraction <= 1
        self.stages.add(stage)
        self.left -= 1
        if self.left >= 0:
            return True
        self.asked_again += self.left < -1
        return False


@settings(max_examples=examples(5))
@given(calls=st.integers(0, 12))
def test_cancelled_bake_leaves_the_session_as_before(calls):
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=200_000, gather=16) as session:
        session.progress = stopper = Stopper(calls)
        try:
            session.bake()
        except dl.Cancelled:
            with pytest.raises(dl.OptionError, match="bake"):
                _ = session.irradiance
        assert stopper.asked_again == 0
        session.progress = None
        session.bake()
        reference = session.digest()
        session.progress = Stopper(calls)
        try:
            session.recompute()
        except dl.Cancelled:
            session.progress = None
            assert session.digest() == reference


@settings(max_examples=examples(10))
@given(calls=st.integers(0, 10), direct=st.sampled_from(["paths", "sampled"]))
def test_cancelled_update_is_finished_by_the_next(calls, direct):
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=120_000, gather=64, direct=direct) as session:
        session.bake()
        session.set_reflectance("wall", (0.3, 0.3, 0.3))
        session.move("lamp", translation(0.9, 1.2, -0.4))
        session.progress = Stopper(calls)
        try:
            session.update()
        except dl.Cancelled:
            session.progress = None
            # Whether it stopped before or in the middle, the state that was asked for comes next.
            session.update()
        session.progress = None
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest
        with dl.Session(scene, samples_in(scene), paths=120_000, gather=64, direct=direct) as other:
            other.bake()
            other.set_reflectance("wall", (0.3, 0.3, 0.3))
            other.move("lamp", translation(0.9, 1.2, -0.4))
            assert other.digest() == digest
        assert session.energy["absorbed"][0] + session.energy["escaped"][0] == session.energy["emitted"][0]


def test_a_cancelled_gradient_stops_soon():
    """A third of all segments are first flights: they must not be deposited in one go.

    By processor time, which other programs do not lengthen.
    """
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.06, radius=0.15)
    cancel = False
    waits = []

    def watch(stage, fraction):
        if not cancel or stage != "deposit":
            return True
        waits.append(time.process_time())
        return False

    with dl.Session(
        scene, samples, paths=65_536, gather="off", threads=1, direct="paths", progress=watch
    ) as session:
        session.bake()
        start = time.process_time()
        _ = session.gradient
        whole = time.process_time() - start
        cancel = True
        latencies = []
        for _ in range(3):
            waits.clear()
            with pytest.raises(dl.Cancelled):
                _ = session.gradient
            latencies.append(time.process_time() - waits[0])
        assert min(latencies) < whole / 10


def test_errors_in_the_callback_propagate():
    scene = room()

    def broken(stage, fraction):
        raise RuntimeError("from the callback")

    with (
        dl.Session(scene, samples_in(scene), paths=200_000, progress=broken) as session,
        pytest.raises(RuntimeError, match="callback"),
    ):
        session.bake()


def test_control_c_stops_a_bake():
    code = (
        "import deltalux as dl\n"
        "s = dl.Session(dl.scenes.office(), paths=30_000_000)\n"
        "print('ready', flush=True)\n"
        "try:\n    s.bake()\nexcept KeyboardInterrupt:\n    print('stopped', flush=True)\n"
    )
    with subprocess.Popen(
        [sys.executable, "-c", code],
        stdout=subprocess.PIPE,
        text=True,
        preexec_fn=listen_to_interrupts,
    ) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)
        process.send_signal(signal.SIGINT)
        watchdog = threading.Timer(60, process.kill)
        watchdog.start()
        assert process.stdout.readline() == "stopped\n"
        watchdog.cancel()


# ---- limits and wrong arguments ---------------------------------------------------------------


def test_memory_limit_refuses_with_a_number_that_fits():
    scene = room()
    limit = 30 << 20
    session = dl.Session(scene, samples_in(scene), paths=3_000_000, gather=256, memory_limit=limit)
    with session, pytest.raises(dl.OptionError, match="would fit") as refusal:
        session.bake()
    fits = int(str(refusal.value).split("about ")[-1].split(" paths")[0])
    assert 10_000 < fits < 3_000_000
    with dl.Session(scene, samples_in(scene), paths=fits, gather=256, memory_limit=limit) as session:
        session.bake()
        assert session.statistics["bytes"] < limit


def test_no_light_gives_zero():
    scene = dl.Scene([dl.Mesh("walls", *box((2, 2, 2), inward=True), "grey")], [dl.Material("grey")])
    with dl.Session(scene, dl.Samples.on_vertices(scene), paths=1000, gather=16) as session:
        session.bake()
        assert (session.irradiance == 0).all()
        assert (session.standard_error == 0).all()


def test_one_path_and_no_samples():
    scene = room()
    empty = dl.Samples(np.zeros((0, 3)), np.zeros((0, 3)), radius=0.1)
    with dl.Session(scene, empty, paths=1) as session:
        session.bake()
        assert session.irradiance.shape == (0, 3)
        session.move("block", translation(0.2, 0.5, 0.3))
        assert session.update().done == 1
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest


def test_degenerate_triangles_and_far_samples_are_harmless():
    vertices, triangles = box((2, 2, 2), inward=True)
    triangles = np.concatenate([triangles, [(0, 0, 1), (2, 2, 2)]])
    scene = dl.Scene(
        [
            dl.Mesh("walls", vertices, triangles, "grey"),
            dl.Mesh("flat lamp", np.zeros((3, 3)), [(0, 1, 2)], "glow"),
        ],
        [dl.Material("grey"), dl.Material("glow", emission=(1, 1, 1))],
        [dl.PointLight("bulb", (0, 0, 0))],
    )
    samples = dl.Samples([(1e6, 0, 0), (0, -0.9, 0)], [(0, 1, 0)] * 2)
    with dl.Session(scene, samples, paths=1000, gather=64) as session:
        session.bake()
        assert np.isfinite(session.irradiance).all()
        assert (session.irradiance[0] == 0).all()
        assert (session.irradiance[1] > 0).all()


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda s: s.move("walls", np.eye(4)), "static"),
        (lambda s: s.move("nothing", np.eye(4)), "nothing"),
        (lambda s: s.move("block", 2 * np.eye(4)), "rigid"),
        (lambda s: s.move("block", np.eye(3)), "shape"),
        (lambda s: s.move("block", np.full((4, 4), np.nan)), "finite"),
        (lambda s: s.move("block", translation(2e15, 0, 0)), "beyond 1e15 m"),
        (lambda s: s.add("block"), "already"),
        (lambda s: s.add(dl.Mesh("walls", *box((1, 1, 1)), "wall", movable=True)), "name"),
        (lambda s: s.add(dl.Mesh("static", *box((1, 1, 1)), "wall")), "movable"),
        (lambda s: s.dim("nothing", 0.5), "group"),
        (lambda s: s.dim("desk", -1), "factor"),
        (lambda s: s.dim("desk", np.nan), "factor"),
        (lambda s: s.set_reflectance("wall", (2, 0, 0)), "0 to 1"),
        (lambda s: s.set_reflectance("nothing", (0, 0, 0)), "nothing"),
        (lambda s: s.update(budget_ms=-1), "budget_ms"),
    ],
)
def test_wrong_edits_change_nothing(baked, make, words):
    digest = baked.digest()
    with pytest.raises(dl.OptionError, match=words):
        make(baked)
    baked.update()
    assert baked.digest() == digest


@pytest.mark.parametrize(
    "options",
    [
        {"paths": 0},
        {"paths": 1.5},
        {"paths": 2**40},
        {"seed": -1},
        {"threads": 0},
        {"direct": "maybe"},
        {"segment_end": "third"},
        {"disc_area": "half"},
        {"static_method": "guess"},
    ],
)
def test_wrong_options(options):
    scene = room()
    with pytest.raises(dl.OptionError, match=next(iter(options))):
        dl.Session(scene, samples_in(scene), **options)


@pytest.mark.parametrize(
    "arguments",
    [
        ([(0, 0, np.nan)], [(0, 1, 0)]),
        ([(0, 0, 0)], [(0, 0, 0)]),
        ([(0, 0, 0)], [(0, 1, 0)], -1.0),
        ([(0, 0, 0)], [(0, 1, 0)], [0.1, 0.2]),
        ([(0, 0)], [(0, 1, 0)]),
        ("text", [(0, 1, 0)]),
    ],
)
def test_wrong_samples(arguments):
    with pytest.raises(dl.OptionError, match="samples"):
        dl.Samples(*arguments)


def test_places_that_no_ray_may_start_from_are_refused(baked):
    """Embree, built with assertions, would end the process."""
    for far in (1e16, 1e300):
        with pytest.raises(dl.OptionError, match="samples: points: found a coordinate of 1e"):
            dl.Samples([(0, 0, 0), (far, 0, 0)], (0, 1, 0), radius=0.1)
    floor = ("floor", [(-1, 0, -1), (1, 0, -1), (1, 0, 1)], [(0, 2, 1)], "grey")
    for kind, lights, pose in (
        ("light", [dl.PointLight("bulb", (0, 1e20, 0))], np.eye(4)),
        ("mesh", [], translation(0, 1e20, 0)),
        ("mesh", [], translation(0, 1e300, 0)),
    ):
        scene = dl.Scene([dl.Mesh(*floor, pose=pose)], [dl.Material("grey")], lights)
        with pytest.raises(dl.SceneError, match=f"{kind}.*1e15 m"):
            dl.Session(scene, dl.Samples((0, 0, 0), (0, 1, 0), radius=0.1))
    for far in (1e16, 1e30, 1e300):
        with pytest.raises(dl.OptionError, match="expected at most"):
            baked.at([(far, 0, 0)], [(0, 1, 0)])
    assert np.isfinite(baked.at([(1e15, 0, 0)], [(0, 1, 0)], gradients=True)).all()


def test_closed_sessions_say_so():
    scene = room()
    session = dl.Session(scene, samples_in(scene), paths=100)
    session.close()
    with pytest.raises(dl.OptionError, match="closed"):
        session.bake()


def test_results_outlive_the_session_and_pickle(baked):
    import pickle

    result = pickle.loads(pickle.dumps(baked.result))
    np.testing.assert_array_equal(result.irradiance, baked.irradiance)


@pytest.mark.parametrize("direct", ["sampled", "paths"])
def test_gradient_under_a_point_light(direct):
    """E = I h / (h² + r²)^1.5 under a bulb; the gradient points inwards.

    Sampled: central differences, within 2 %. Paths: mean ratio over 12 samples at 4e6 paths; null
    hypothesis "unbiased", tolerance 6 % is about 4 standard errors (5 % spread / sqrt(12)), false
    alarm rate below 1e-4.
    """
    corners = [(-5, 0, -5), (5, 0, -5), (5, 0, 5), (-5, 0, 5)]
    scene = dl.Scene(
        [dl.Mesh("floor", corners, [(0, 2, 1), (0, 3, 2)], "black")],
        [dl.Material("black", (0, 0, 0))],
        [dl.PointLight("bulb", (0, 2, 0), (1, 1, 1))],
    )
    x = np.linspace(0.3, 3, 12)
    samples = dl.Samples(np.stack([x, 0 * x, 0 * x], axis=1), [(0, 1, 0)], radius=0.25)
    with dl.Session(scene, samples, paths=4_000_000 if direct == "paths" else 1000, direct=direct) as session:
        session.bake()
        gradient = session.gradient
    expected = -6 * x / (4 + x * x) ** 2.5
    ratio = gradient[:, 0, 0] / expected
    if direct == "sampled":
        np.testing.assert_allclose(ratio, 1, atol=0.02)
    else:
        assert abs(ratio.mean() - 1) < 0.06
    assert gradient.shape == (12, 3, 3)


def test_cancelled_insertion_happens_with_the_next_update():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=400_000, gather=64, direct="sampled") as session:
        session.bake()
        session.add(dl.Mesh("new", *box((0.3, 0.3, 0.3)), "glow", pose=translation(0.2, 1, 0), movable=True))
        session.set_reflectance("wall", (0.3, 0.3, 0.3))
        session.progress = Stopper(0)
        with pytest.raises(dl.Cancelled):
            session.update()
        session.progress = None
        session.update()
        session.move("new", translation(0.4, 1, 0.1))
        session.update()
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest
