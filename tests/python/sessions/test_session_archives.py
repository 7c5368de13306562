# SPDX-License-Identifier: Apache-2.0
"""Session files: what is saved comes back, and neither way takes memory for a copy."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux import snapshot
from deltalux.stored import archive
from deltalux.stored.facts import file_facts
from rooms import box, room, samples_in, translation
from session_files import rewrite
from thoroughness import slow

TARGET = translation(-0.5, 0.6, -0.3)


def state(session):
    return {
        "digest": session.digest(),
        "irradiance": session.irradiance,
        "standard_error": session.standard_error,
        "packed": session.read_packed(),
        "sums": session.sums,
        "radius": session.radius,
        "gradient": session.gradient,
        "emitted": session.energy["emitted"],
        "reflectances": session.reflectances,
        "factors": session.dim_factors,
        "box": session.box,
        **{f"pose of {name}": session.pose(name) for name in session.poses},
        "present": [name for name, pose in session.poses.items() if pose is not None],
    }


def assert_same(found, expected):
    assert found.keys() == expected.keys()
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


def lamp(name, place):
    return dl.Mesh(name, *box((0.2, 0.2, 0.2)), "glow", pose=translation(*place), movable=True)


# ---- what is saved comes back -------------------------------------------------------------------


def test_no_file_holds_what_is_only_queued(tmp_path):
    scene, path = room(), tmp_path / "a.dlx"
    with dl.Session(scene, samples_in(scene), paths=200, gather=64, threads=1) as session:
        session.bake()
        session.set_reflectance("wall", (0.1, 0.2, 0.3))
        with pytest.raises(dl.OptionError, match=r"save: found 1 queued edits, expected none; call update"):
            snapshot.write(path, session)
        assert not path.exists()
        session.update()
        snapshot.write(path, session)
        with dl.Session.open(path) as opened:
            assert opened.reflectances["wall"] == (0.1, 0.2, 0.3)


@pytest.mark.parametrize("recomputed", [slow(False), True])
@pytest.mark.parametrize("pending", [False, True])
@pytest.mark.parametrize("direct", [slow("paths"), "auto", slow("sampled")])
def test_sessions_with_new_lamps_open_again(tmp_path, direct, pending, recomputed):
    """Whatever brings their direct light, and with work that is still to be done."""
    scene, path, again = room(), tmp_path / "a.dlx", tmp_path / "b.dlx"
    with dl.Session(scene, samples_in(scene), paths=2000, gather=64, direct=direct, threads=1) as session:
        session.bake()
        session.add(lamp("first", (0.4, 0.7, -0.2)))
        session.update()
        session.add(lamp("second", (-0.4, 1.2, 0.6)))
        session.add(lamp("third", (1.2, 1.5, 0.9)))
        session.remove("lamp")
        session.update()
        if recomputed:
            session.recompute()
        if pending:
            session.move("first", translation(0.5, 0.9, 0.1))
            session.set_reflectance("wall", (0.1, 0.2, 0.3))
            assert session.update(budget_ms=1e-6).done < 1
        snapshot.write(path, session)
        with dl.Session.open(path, threads=1) as opened:
            for each in (session, opened):
                if pending:
                    each.update()
            assert_same(state(opened), state(session))
            opened.save(again)
            with dl.Session.open(again, threads=1) as third:
                assert_same(state(third), state(session))
            for each in (session, opened):
                each.move("second", translation(-0.5, 1.1, 0.2))
                each.add("lamp")
                each.update()
            assert opened.digest() == session.digest()
            opened.recompute()
            assert opened.digest() == session.digest()


def test_a_lamp_in_a_large_set_of_samples_brings_its_light_by_paths(tmp_path):
    """Where shadow rays to every sample would cost too much, no light has any."""
    scene, path = room(), tmp_path / "a.dlx"
    points = np.random.default_rng(1).uniform((-1.9, 0.1, -1.4), (1.9, 1.9, 1.4), (20_000, 3))
    samples = dl.Samples(points, (0, 1, 0), radius=0.05)
    with dl.Session(scene, samples, paths=50, threads=1, gather="off") as session:
        session.bake()
        assert not any(light["sampled"] for light in session.statistics["lights"])
        session.add(lamp("new", (0.4, 0.7, -0.2)))
        session.update()
        session.save(path)
        with dl.Session.open(path, threads=1) as opened:
            assert opened.digest() == session.digest()


def test_reflectances_stay_as_they_were_given(tmp_path):
    """In double precision, though the core computes with single."""
    scene, given = room(), (0.1, 0.7, 1 / 3)
    with dl.Session(scene, samples_in(scene), paths=500, gather=64, threads=1) as session:
        session.set_reflectance("wall", given)
        for _ in range(2):
            expected = {m.name: tuple(m.reflectance.tolist()) for m in scene.materials} | {"wall": given}
            assert session.reflectances == expected
            session.save(tmp_path / "a.dlx")
            with dl.Session.open(tmp_path / "a.dlx") as opened:
                assert opened.reflectances == expected
            session.bake()


def test_the_same_session_makes_the_same_file(tmp_path):
    """Opening one changes no bit, not even of directions, which are scaled to length 1."""
    scene = room()
    directions = np.random.default_rng(1).normal(size=(500, 3))
    suns = [dl.SunLight(f"sun{i}", way, (1, 1, 1), group="suns") for i, way in enumerate(directions[:20])]
    scene = dl.Scene(scene.meshes, scene.materials, [*scene.lights, *suns])
    samples = dl.Samples(np.full((500, 3), 0.5), directions, radius=0.1)
    with dl.Session(scene, samples, paths=500, gather=16, threads=1) as session:
        session.bake()
        session.save(tmp_path / "a.dlx")
        with dl.Session.open(tmp_path / "a.dlx", threads=1) as opened:
            opened.save(tmp_path / "b.dlx")
    assert (tmp_path / "a.dlx").read_bytes() == (tmp_path / "b.dlx").read_bytes()


@pytest.mark.parametrize("gather", [32, "off"])
def test_files_are_compressed_and_older_ones_are_read(tmp_path, gather):
    """Those that were written before hold their arrays as they are."""
    scene, path = room(), tmp_path / "a.dlx"
    with dl.Session(scene, samples_in(scene), paths=5000, gather=gather, threads=1) as session:
        session.bake()
        session.save(path)
        expected = state(session)
    small = path.stat().st_size
    with dl.Session.open(path) as opened:
        assert_same(state(opened), expected)
    rewrite(path)
    # Where the vertices of chains lie are random numbers, which nothing makes shorter.
    assert small < (0.5 if gather == "off" else 0.52) * path.stat().st_size
    with dl.Session.open(path) as opened:
        assert_same(state(opened), expected)


def deflated(path, change):
    """Write the file's entries anew, compressed, after `change` of (name, bytes)."""
    with zipfile.ZipFile(path) as before:
        entries = [change(name, before.read(name)) for name in before.namelist()]
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as after:
        for name, data in entries:
            after.writestr(name, data)


@pytest.fixture
def small_file(tmp_path):
    scene, path = room(), tmp_path / "a.dlx"
    with dl.Session(scene, samples_in(scene), paths=200, gather="off", threads=1) as session:
        session.bake()
        session.save(path)
    return path


def test_what_would_grow_beyond_measure_is_refused_before_it_is_read(small_file):
    zeros = bytes(160 << 20)
    for name in ("deltalux.json", "core/sums.npy", "core/more.npy"):
        path = small_file.with_name("bomb.dlx")
        shutil.copy(small_file, path)
        deflated(path, lambda entry, data, name=name: (entry, data + zeros if entry == name else data))
        if name == "core/more.npy":
            with zipfile.ZipFile(path, "a", zipfile.ZIP_DEFLATED) as file:
                file.writestr(name, zeros)
        assert path.stat().st_size < 1 << 20
        with pytest.raises(
            dl.FormatError, match=r"bytes once decompressed, expected at most 100 times the file's"
        ):
            dl.Session.open(path)
        with pytest.raises(dl.FormatError, match="once decompressed"):
            file_facts(path)


def test_what_does_not_fit_into_memory_is_refused(small_file, monkeypatch):
    monkeypatch.setattr(archive, "available_memory", lambda: 1000)
    with pytest.raises(dl.FormatError, match="and what fits into memory"):
        dl.Session.open(small_file)


def test_sizes_that_lie_are_found(small_file):
    """An entry that decompresses to more, or to less, than the directory says."""
    data = bytearray(small_file.read_bytes())
    with zipfile.ZipFile(small_file) as whole:
        names = [n.encode() for n in whole.namelist() if n.startswith("core/")]
    for name in names[:: max(1, len(names) // 6)]:
        for lie in (-8, 8, 1 << 20):
            place = data.rfind(name) - 46 + 24  # of the size in the directory's entry
            size = int.from_bytes(data[place : place + 4], "little")
            if not 0 <= size + lie < 1 << 32:
                continue
            changed = data.copy()
            changed[place : place + 4] = (size + lie).to_bytes(4, "little")
            path = small_file.with_name("lie.dlx")
            path.write_bytes(changed)
            with pytest.raises(dl.FormatError):
                dl.Session.open(path)


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_compressions_are_refused(small_file, method):
    with zipfile.ZipFile(small_file) as before:
        entries = [(name, before.read(name)) for name in before.namelist()]
    with zipfile.ZipFile(small_file, "w", method) as after:
        for name, data in entries:
            after.writestr(name, data)
    with pytest.raises(dl.FormatError, match="encrypted or compressed otherwise than by DEFLATE"):
        dl.Session.open(small_file)


def test_damage_in_compressed_arrays_is_found(small_file):
    data = bytearray(small_file.read_bytes())
    for place in range(200, len(data), len(data) // 40):
        changed = data.copy()
        changed[place] ^= 0x55
        path = small_file.with_name("damaged.dlx")
        path.write_bytes(changed)
        try:
            dl.Session.open(path).close()
        except dl.FormatError:
            continue
        except dl.SceneError:
            continue


def test_a_foreign_mark_stays_until_the_light_is_computed_here(tmp_path):
    """Through opening and saving, as often as one likes."""
    scene, path = room(), tmp_path / "a.dlx"
    with dl.Session(scene, samples_in(scene), paths=500, gather=64, threads=1) as session:
        session.bake()
        session.save(path)
    rewrite(path, index=lambda index: index.update(built_by="another build"))
    for _ in range(3):
        with dl.Session.open(path, threads=1) as opened:
            assert opened.foreign_build.startswith("another build; this is embree")
            opened.save(path)
    with dl.Session.open(path, threads=1) as opened:
        opened.move("block", TARGET)
        with pytest.raises(dl.OptionError, match=r"another build.*recompute\(\)"):
            opened.update()
        opened.recompute()
        assert opened.foreign_build is None
        opened.save(path)
    with dl.Session.open(path, threads=1) as opened:
        assert opened.foreign_build is None
        opened.move("block", translation(0.5, 0.6, 0.3))
        opened.update()
        digest = opened.digest()
        opened.recompute()
        assert opened.digest() == digest


def test_what_no_reader_would_accept_is_not_written(tmp_path, monkeypatch):
    scene = room()
    path = tmp_path / "a.dlx"
    with dl.Session(scene, samples_in(scene), paths=100, gather=64) as session:
        session.save(path)
        old = path.read_bytes()
        monkeypatch.setattr(archive, "MOST_INDEX", 100)
        with pytest.raises(dl.OptionError, match="save: the scene's names and nodes take"):
            session.save(path)
    camera = dl.Camera("c", np.full((4, 4), np.nan))
    odd = dl.Scene(scene.meshes, scene.materials, scene.lights, cameras=[camera])
    with (
        dl.Session(odd, samples_in(odd), paths=100) as session,
        pytest.raises(dl.OptionError, match="holds a number that is not finite"),
    ):
        session.save(path)
    assert path.read_bytes() == old


# ---- memory ---------------------------------------------------------------------------------------

MEASURE = """
import gc, sys
sys.path[:0] = {tests!r}
import deltalux as dl
from rooms import room

def kilobytes(key):
    return next(int(line.split()[1]) for line in open("/proc/self/status") if line.startswith(key))

def peak_of(work):
    gc.collect()
    open("/proc/self/clear_refs", "w").write("5")
    before = kilobytes("VmRSS")
    work()
    return (kilobytes("VmHWM") - before) / 1024

scene = room()
if sys.argv[1] == "save":
    samples = dl.Samples.on_vertices(scene, spacing=0.3, radius=0.1)
    s = dl.Session(scene, samples, paths=400_000, threads=1, direct="paths", static_method="disc_index",
                   gather={gather!r})
    s.bake()
    print(s.statistics["bytes"] / 2**20, peak_of(lambda: s.save(sys.argv[2])))
else:
    print(peak_of(lambda: globals().update(s=dl.Session.open(sys.argv[2], threads=1))))
"""


@pytest.mark.skipif(not Path("/proc/self/clear_refs").exists(), reason="needs Linux's count of memory")
@pytest.mark.parametrize(("gather", "saving", "opening"), [("off", 0.1, 1.2), slow(256, 0.1, 1.2)])
def test_neither_save_nor_open_takes_memory_for_a_copy(gather, saving, opening, tmp_path):
    def measured(*arguments):
        code = MEASURE.format(tests=[str(folder) for folder in Path(__file__).parents[1:3]], gather=gather)
        ran = subprocess.run(
            [sys.executable, "-c", code, *arguments], capture_output=True, text=True, check=True, timeout=200
        )
        return [float(word) for word in ran.stdout.split()]

    path = str(tmp_path / "a.dlx")
    session, save = measured("save", path)
    assert session > 50
    assert save < saving * session
    (opened,) = measured("open", path)
    assert opened < opening * session
    shutil.rmtree(tmp_path)
