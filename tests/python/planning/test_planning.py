# SPDX-License-Identifier: Apache-2.0
"""Predictions from a hundredth of the segments, the machine's constants, plans and their choice."""

from __future__ import annotations

import json
import time

import deltalux as dl
import numpy as np
import pytest
from deltalux import _core, planning
from deltalux.planning import machine_constants, predict
from deltalux.planning.parts import PAPER_SIZE, MethodPlan, PartPlan
from rooms import room, samples_in, translation
from thoroughness import slow

METHODS = ("brute_force", "disc_index", "ray_map", "sphere_cache")


def samples_in_ball(count, radius, seed=5):
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(count, 3))
    points *= (rng.uniform(0, 1, count) ** (1 / 3) / np.linalg.norm(points, axis=1))[:, None]
    return dl.Samples(points, rng.normal(size=(count, 3)), radius=radius)


class TestPredict:
    def test_a_hundredth_of_the_lines_predicts_the_tests(self):
        """Sphere and disc tests within 1.5 %; 5000 lines at random would miss by 1.5 % (one sigma)."""
        lines, samples = dl.uniform_lines(1 << 19, seed=3), samples_in_ball(2000, 0.05)
        found = predict(lines, samples, ("disc_index", "sphere_cache"))
        for method, kinds in (
            ("disc_index", ("node_tests", "disc_tests")),
            ("sphere_cache", ("sphere_tests", "disc_tests")),
        ):
            full = getattr(dl.estimate, method)(lines, samples).stats
            for kind in kinds:
                assert found[method].counts[kind] == pytest.approx(full[kind], rel=0.015), (method, kind)

    @pytest.mark.slow
    @pytest.mark.parametrize("scene", ["atrium", "expo"])
    def test_in_scenes_too(self, scene):
        """Within four standard errors of a pilot of 4300 segments, measured over ten: 0.4 % and 0.9 %."""
        scene = getattr(dl.scenes, scene)()
        segments = dl.trace(scene, 130_000, seed=2)
        display = dl.Samples.on_vertices(scene, 4.0)
        rest = display.attached == None  # noqa: E711, elementwise
        samples = dl.Samples(display.points[rest], display.normals[rest], radius=0.8)
        found = predict(segments, samples, ("sphere_cache",), segment_end="first")["sphere_cache"].counts
        full = dl.estimate.sphere_cache(segments, samples, segment_end="first").stats
        assert found["sphere_tests"] == pytest.approx(full["sphere_tests"], rel=0.016)
        assert found["disc_tests"] == pytest.approx(full["disc_tests"], rel=0.036)

    def test_lists_too_short_to_tell_shrink_as_counted(self):
        """So small are the discs that the limit of rays ends every chain: 9 to 13 % too few disc tests."""
        lines, samples = dl.uniform_lines(1 << 18, seed=3), samples_in_ball(5000, 0.005)
        found = predict(lines, samples, ("sphere_cache",))["sphere_cache"].counts
        full = dl.estimate.sphere_cache(lines, samples).stats
        assert found["sphere_tests"] == pytest.approx(full["sphere_tests"], rel=0.015)
        assert found["disc_tests"] == pytest.approx(full["disc_tests"], rel=0.2)

    def test_few_segments_are_counted_in_full(self):
        lines, samples = dl.uniform_lines(3000, seed=3), samples_in_ball(500, 0.1)
        found = predict(lines, samples)
        for method in METHODS[1:]:
            full = getattr(dl.estimate, method)(lines, samples).stats
            for kind in ("disc_tests", "node_tests", "sphere_tests", "box_tests", "hits"):
                assert found[method].counts[kind] == full.get(kind, 0), (method, kind)
        assert found["brute_force"].counts["disc_tests"] == 3000 * 500

    def test_counts_do_not_depend_on_threads(self):
        lines, samples = dl.uniform_lines(50_000), samples_in_ball(1000, 0.05)
        one, two = (predict(lines, samples, threads=n) for n in (1, 2))
        for method in METHODS:
            assert one[method].counts == two[method].counts

    @pytest.mark.parametrize(
        ("segments", "options", "words"),
        [
            (100, {"methods": ("guess",)}, "methods: found 'guess'"),
            (100, {"segment_end": "third"}, "segment_end: found 'third'"),
            (0, {}, "predict: found no segments or no samples"),
        ],
    )
    def test_wrong_options_are_refused(self, segments, options, words):
        lines = dl.uniform_lines(100).select(slice(0, segments))
        with pytest.raises(dl.OptionError, match=words):
            predict(lines, samples_in_ball(5, 0.1), **options)


class TestMachine:
    @pytest.fixture(autouse=True)
    def fresh(self, monkeypatch, tmp_path):
        """Own cache folder, nothing known, and a calibration that takes no time."""
        self.calls = []
        monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
        monkeypatch.setattr(planning.machine, "_known", {})
        monkeypatch.setattr(
            _core, "calibrate", lambda progress: self.calls.append(1) or _core.typical_machine()
        )
        self.file = tmp_path / "deltalux" / "machine.json"
        self.forget = lambda: monkeypatch.setattr(planning.machine, "_known", {})
        self.patch = monkeypatch

    def test_is_calibrated_once_per_process_and_machine(self):
        first = machine_constants()
        assert machine_constants() is first
        self.forget()
        assert machine_constants() == first
        assert len(self.calls) == 1
        assert not list(self.file.parent.glob("*.part"))

    @pytest.mark.parametrize("what", ["processor", "build"])
    def test_is_renewed_when_the_machine_differs(self, what):
        machine_constants()
        self.forget()
        if what == "processor":
            self.patch.setattr(planning.machine, "processor", lambda: "another")
        else:
            self.patch.setattr(planning.machine, "core_build", lambda: "another")
        machine_constants()
        assert len(self.calls) == 2

    @pytest.mark.parametrize(
        "damage",
        [
            lambda data: "no json",
            lambda data: "[]",
            lambda data: json.dumps(data | {"version": 0}),
            lambda data: json.dumps(data | {"machine": {}}),
            lambda data: json.dumps(data | {"machine": {"disc_index": [[1.0]]}}),
            lambda data: json.dumps(data).replace("1e-08", "NaN"),
        ],
    )
    def test_a_damaged_file_is_replaced(self, damage):
        good = machine_constants()
        self.file.write_text(damage(json.loads(self.file.read_text())))
        self.forget()
        assert machine_constants() == good
        assert len(self.calls) == 2
        assert json.loads(self.file.read_text())["machine"] == good

    def test_works_where_nothing_can_be_written(self):
        self.file.parent.write_text("a file where the folder should be")
        assert machine_constants() == _core.typical_machine()

    def test_core_refuses_what_is_no_machine(self):
        with pytest.raises(dl.OptionError, match="machine: found no constants of"):
            _core.predicted_seconds("ray_map", {}, 1.0, 1.0, {})
        rows = _core.typical_machine() | {"ray_map": [[1.0, 2.0]]}
        with pytest.raises(dl.OptionError, match="machine: found a row of 2 numbers"):
            _core.predicted_seconds("ray_map", {}, 1.0, 1.0, rows)


def test_calibration_gives_times_of_every_method():
    """What is measured must be of this world: a test takes between 0.01 ns and 1 µs."""
    machine = _core.calibrate(None)
    names = _core.count_names()
    for method, kinds in (
        ("brute_force", ("disc_tests",)),
        ("disc_index", ("node_tests", "disc_tests", "hits", "outline_tests")),
        ("ray_map", ("node_tests", "disc_tests", "box_tests", "outline_tests")),
        (
            "sphere_cache",
            ("sphere_tests", "far_tests", "disc_tests", "visits", "rebuilds", "outline_tests", "far_hits"),
        ),
    ):
        for size, build, *seconds in machine[method]:
            assert size >= 1
            assert 0 < build < 1e-4
            for kind in kinds:
                assert 1e-11 < seconds[names.index(kind)] < 1e-6, (method, kind)


class TestPlan:
    def test_every_method_in_every_part(self):
        plan = dl.plan(room(), samples_in(room()), paths=20_000)
        assert next(iter(plan.parts)) == "static"
        assert len(plan.parts) > 1
        for part in plan.parts.values():
            assert sorted(m.method for m in part.methods) == sorted(METHODS)
            assert part.all_piloted
            totals = [m.seconds(part.frames) for m in part.methods]
            assert totals == sorted(totals)
            assert part.frames == 100
            if part.chosen == part.methods[0].method:
                assert "next is" in part.reason
            else:
                assert part.chosen == "disc_index"
                assert f"{part.methods[0].method}, predicted at" in part.reason
        assert "static" in str(plan)
        assert json.loads(json.dumps(plan.as_dict()))["parts"]["static"]["chosen"]

    def test_the_gather_is_about_what_a_session_takes(self):
        """Times within a factor of three on a machine that others use, memory within one of 1.5."""
        scene = room()
        samples = dl.Samples.on_vertices(scene, spacing=0.1)
        assert len(samples) > 2000
        plan = dl.plan(scene, samples, gather=32)
        with dl.Session(scene, samples, gather=32, threads=1) as session:
            start = time.process_time()
            stages = session.bake().milliseconds
            seconds = time.process_time() - start
            bytes_taken = session.statistics["gather"]["ray_bytes"]
        seconds *= sum(stages[own] for own in ("prepare", "guides", "gather")) / sum(stages.values())
        assert plan.gather.rays == 32
        assert plan.paths == 300_000
        assert sorted(plan.gather.frame_seconds) == sorted(scene.movable)
        assert all(0 < frame < plan.gather.bake_seconds for frame in plan.gather.frame_seconds.values())
        assert 1 / 3 < plan.gather.bake_seconds / seconds < 3
        assert 1 / 1.5 < plan.gather.bytes / bytes_taken < 1.5
        assert "gather: 32 rays" in str(plan)
        assert json.loads(json.dumps(plan.as_dict()))["gather"]["rays"] == 32

    def test_sessions_without_a_gather_have_no_plan_of_it(self):
        plan = dl.plan(room(), samples_in(room()), paths=2000, gather="off")
        assert plan.gather is None
        assert plan.as_dict()["gather"] is None

    def test_the_segments_of_a_part_are_those_of_a_session(self):
        """The pilot's estimates against what a session traces and finds near the object."""
        scene, samples = room(), samples_in(room())
        plan = dl.plan(scene, samples, paths=20_000, direct="paths")
        with dl.Session(scene, samples, paths=20_000, direct="paths") as session:
            session.bake()
            assert {name: part.chosen for name, part in plan.parts.items()} == {
                name: part.chosen for name, part in session.plan.parts.items()
            }
            assert plan.parts["static"].bake_segments == pytest.approx(
                session.statistics["segments"], rel=0.02
            )
            session.move("block", translation(-0.4, 0.5, 0.1))
            frame = session.update()
        # One object at a time, its old and its new place alike; the pilot takes all movables.
        assert 0 < plan.parts["static"].frame_segments < 3 * frame.retraced_segments

    @pytest.mark.parametrize("policy", ["paper-sphere", slow("paper-box")])
    def test_the_papers_rule(self, policy):
        plan = dl.plan(room(), samples_in(room()), paths=2000, policy=policy)
        assert plan.parts["static"].chosen == "disc_index"
        for name, part in plan.parts.items():
            if name != "static":
                size = part.size_by_sphere if policy == "paper-sphere" else part.size_by_box
                assert 0 < size < 1
                assert part.chosen == ("sphere_cache" if size < PAPER_SIZE else "disc_index")
                assert f"{size:.0%}" in part.reason

    def test_counts_are_those_of_the_seed_on_any_number_of_threads(self):
        plans = [dl.plan(room(), samples_in(room()), paths=9000, gather="off", threads=n) for n in (1, 1, 2)]
        counts = [
            {
                m.method: m.bake_counts["disc_tests"]
                for m in plan.parts["static"].methods
                if m.method in METHODS[:2]
            }
            for plan in plans
        ]
        assert counts[0] == counts[1] == counts[2]

    @pytest.mark.parametrize(
        ("index", "other", "expected"),
        [
            ((8.0, 1.0, 1.0), (0.0, 2.0, 3.0), 4),  # 9 + f <= 2 + 3 f from 3.5 frames on
            ((1.0, 1.0, 1.0), (0.0, 5.0, 3.0), 0),
            ((8.0, 1.0, 1.0), (0.0, 2.0, 1.0), None),
            ((1.0, 1.0, 3.0), (0.0, 5.0, 1.0), None),  # cheaper for some frames, then no more
        ],
    )
    def test_an_index_pays_after_some_frames(self, index, other, expected):
        methods = [
            MethodPlan(name, *times, bytes=0, piloted=True, bake_counts={}, frame_counts={})
            for name, times in (("disc_index", index), ("ray_map", other))
        ]
        part = PartPlan("static", 1, 1.0, 1.0, 100.0, 0.0, 0.0, "disc_index", "", methods)
        assert part.pays_after == expected

    @pytest.mark.parametrize("piloted", [(), (True, False)])
    def test_whether_an_index_pays_is_known_from_pilots_of_all(self, piloted):
        methods = [
            MethodPlan(name, 1.0, 1.0, 1.0, bytes=0, piloted=known, bake_counts={}, frame_counts={})
            for name, known in zip(METHODS, piloted, strict=False)
        ]
        part = PartPlan("static", 1, 1.0, 1.0, 100.0, 0.0, 0.0, "disc_index", "", methods)
        assert not part.all_piloted
        assert part.pays_after is None

    @pytest.mark.parametrize(
        ("options", "words"),
        [
            ({"policy": "luck"}, "policy: found 'luck'"),
            ({"frames": -1}, "frames: found -1"),
            ({"frames": float("nan")}, "frames: found nan"),
            ({"paths": 0}, "paths: found 0"),
            ({"gather": 7}, "gather: found 7"),
            ({"segment_end": "third"}, "segment_end: found 'third'"),
        ],
    )
    def test_wrong_options_are_refused(self, options, words):
        with pytest.raises(dl.OptionError, match=words):
            dl.plan(room(), samples_in(room()), **options)

    def test_cancels(self):
        with pytest.raises(dl.Cancelled):
            dl.plan(room(), samples_in(room()), paths=10_000_000, progress=lambda stage, done: False)


class TestSessions:
    def test_a_session_says_what_it_runs_on(self):
        scene, samples = room(), samples_in(room())
        with dl.Session(scene, samples, paths=2000, gather=16, moving_method="ray_map") as session:
            with pytest.raises(dl.OptionError, match="call bake"):
                _ = session.plan
            session.bake()
            plan = session.plan
            assert plan.parts["static"].chosen in METHODS
            assert plan.parts["block"].chosen == "ray_map"
            assert plan.parts["block"].reason == "asked for"

    def test_the_choice_is_made_at_the_bake_and_not_in_an_update(self):
        scene, samples = room(), samples_in(room())
        with dl.Session(scene, samples, paths=2000, gather=16) as session:
            session.bake()
            before = session.plan.as_dict()
            session.move("block", translation(-0.4, 0.5, 0.1))
            session.update()
            assert session.plan.as_dict() == before
            session.recompute()
            assert session.plan.as_dict() == before

    def test_a_session_made_with_numpy_integers_can_be_saved(self, tmp_path):
        with dl.Session(
            room(), samples_in(room()), paths=np.int64(500), gather=16, seed=np.int32(2)
        ) as session:
            session.bake()
            session.save(tmp_path / "s.dlx")
            with dl.Session.open(tmp_path / "s.dlx") as opened:
                assert opened.digest() == session.digest()

    def test_automatic_methods_give_the_same_bits(self, tmp_path):
        scene, samples = room(), samples_in(room())
        digests = set()
        for method in ("auto", *METHODS):
            with dl.Session(
                scene, samples, paths=3000, gather=16, static_method=method, moving_method=method
            ) as session:
                session.bake()
                session.save(tmp_path / "s.dlx")
                with dl.Session.open(tmp_path / "s.dlx") as opened:
                    assert {p: q.chosen for p, q in opened.plan.parts.items()} == {
                        p: q.chosen for p, q in session.plan.parts.items()
                    }
                    opened.move("block", translation(-0.4, 0.5, 0.1))
                    opened.update()
                    digests.add(opened.digest())
        assert len(digests) == 1


def test_methods_that_forget_their_hits_search_for_old_segments_too():
    scene = room()
    methods = dl.plan(scene, samples_in(scene), paths=4000).parts["static"].methods
    segments = {m.method: m.frame_counts["segments"] for m in methods}
    assert segments["brute_force"] == segments["disc_index"] > 0
    assert segments["sphere_cache"] == segments["ray_map"] == pytest.approx(2 * segments["disc_index"])
