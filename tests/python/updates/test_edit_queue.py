# SPDX-License-Identifier: Apache-2.0
"""Edits between being queued and being applied: nothing gets lost, nothing is applied twice."""

from __future__ import annotations

import os
import signal
import threading

import deltalux as dl
import numpy as np
import pytest
from edit_sequences import equals_recompute
from rooms import box, room, samples_in, translation, turn
from session_files import rewrite
from thoroughness import slow

TARGET = translation(0.4, 0.7, -0.2) @ turn(0.4)


@pytest.fixture
def baked():
    scene = room(groups=3)
    with dl.Session(scene, samples_in(scene), paths=4000, threads=1, gather="off") as session:
        session.bake()
        yield session


def new_lamp(name="new", pose=TARGET, side=0.2, material="glow"):
    return dl.Mesh(name, *box((side, side, side)), material, pose=pose, movable=True)


def with_material(scene, name, emission):
    material = dl.Material(name, emission=[emission] * 3, group="desk")
    return dl.Scene(scene.meshes, [*scene.materials, material], scene.lights)


# ---- a new mesh and what follows it in the same queue -------------------------------------------


def test_a_new_mesh_can_be_edited_before_the_update(baked):
    baked.add(new_lamp())
    baked.move("new", translation(-0.5, 1.2, 0.3))
    baked.remove("new")
    baked.add("new")
    baked.add(new_lamp("newer"))
    baked.remove("newer")
    baked.update()
    np.testing.assert_array_equal(baked.pose("new"), translation(-0.5, 1.2, 0.3))
    assert baked.poses["newer"] is None
    equals_recompute(baked)


def test_steps_and_one_update_lead_to_the_same_state():
    scene = room()
    digests = set()
    for at_once in (True, False):
        with dl.Session(scene, samples_in(scene), paths=2000, gather=64) as session:
            session.bake()
            session.add(new_lamp())
            if not at_once:
                session.update()
            session.move("new", translation(-0.5, 1.2, 0.3))
            session.move("block", TARGET)
            session.update()
            digests.add(session.digest())
    assert len(digests) == 1


def test_a_new_lamp_that_does_not_fit_is_refused_when_it_is_added(baked):
    """Its power takes more paths than integer sums hold; the session goes on without it."""
    scene = baked.scene
    huge = dl.Scene(
        scene.meshes,
        [*scene.materials, dl.Material("sun", emission=(1e9, 1e9, 1e9), group="desk")],
        scene.lights,
    )
    with dl.Session(huge, samples_in(scene), paths=4000, gather=64) as session:
        session.bake()
        digest = session.digest()
        with pytest.raises(dl.OptionError, match="paths"):
            session.add(new_lamp(material="sun"))
        assert "new" not in session.poses
        assert session.digest() == digest
        session.add(new_lamp())
        session.update()
        equals_recompute(session)


def test_a_new_lamp_keeps_to_the_memory_limit():
    scene = room()
    glaring = dl.Scene(
        scene.meshes,
        [*scene.materials, dl.Material("glare", emission=(2e3, 2e3, 2e3), group="desk")],
        scene.lights,
    )
    with dl.Session(glaring, samples_in(scene), paths=4000, gather=256, memory_limit=30 << 20) as session:
        session.bake()
        with pytest.raises(dl.OptionError, match="memory"):
            session.add(new_lamp(material="glare", side=0.4))
        session.add(new_lamp(side=0.1))
        session.update()
        assert session.statistics["bytes"] < 30 << 20


# ---- cancelled and failed calls -----------------------------------------------------------------


class CancelAt:
    """A progress callback that stops within a stage, when a part of it is done."""

    def __init__(self, stage):
        self.stage = stage

    def __call__(self, stage, fraction):
        return stage != self.stage or not fraction > 0


# Paths enough for each stage to be told of.
@pytest.mark.usefixtures("reports_at_once")
@pytest.mark.parametrize(
    ("stage", "paths", "spacing"),
    [
        slow("find affected paths", 150_000, 1.0),
        slow("direct light", 150_000, 0.1),
        slow("replace paths", 150_000, 0.1),
        ("replace paths", 150_000, 0.2),
    ],
)
def test_what_a_cancelled_update_was_asked_for_comes_with_the_next(stage, paths, spacing):
    """At whatever stage it stopped: poses, dims, new meshes, irradiance, all of it."""
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=spacing, radius=0.1)
    options = {"paths": paths, "direct": "sampled", "gather": 16}
    with dl.Session(scene, samples, **options, threads=1) as session:
        session.bake()
        session.move("block", TARGET)
        session.dim("desk", 0.5)
        session.set_reflectance("wall", (0.3, 0.4, 0.5))
        session.add(new_lamp(pose=translation(-0.5, 1.2, 0.3)))
        session.progress = CancelAt(stage)
        with pytest.raises(dl.Cancelled):
            session.update()
        session.progress = None
        session.update()
        np.testing.assert_array_equal(session.pose("block"), TARGET)
        equals_recompute(session)
        digest = session.digest()
    with dl.Session(scene, samples, **options) as other:
        other.bake()
        other.move("block", TARGET)
        other.dim("desk", 0.5)
        other.set_reflectance("wall", (0.3, 0.4, 0.5))
        other.add(new_lamp(pose=translation(-0.5, 1.2, 0.3)))
        other.update()
        assert other.digest() == digest


def test_ctrl_c_after_the_work_was_done_leaves_a_baked_session():
    """The signal may come between the last piece of work and the return of bake()."""
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=300_000, gather=64) as session:
        stages = []

        def interrupt(stage, fraction):
            if stage == "direct light" and not stages:
                os.kill(os.getpid(), signal.SIGINT)
            if stage == "direct light":
                stages.append(stage)
            return True

        session.progress = interrupt
        try:
            session.bake()
        except KeyboardInterrupt:
            session.progress = None
            session.bake()
        session.progress = None
        session.move("block", TARGET)
        session.update()
        equals_recompute(session)


class InterruptedOnce:
    """A core session whose first update ends like one that meets Ctrl-C after its edits took effect."""

    def __init__(self, core):
        self._core, self._stop = core, True

    def __getattr__(self, name):
        return getattr(self._core, name)

    def update(self, *arguments):
        frame = self._core.update(*arguments)
        if self._stop:
            self._stop = False
            raise KeyboardInterrupt
        return frame


def test_ctrl_c_while_a_bake_applies_edits_applies_them_once():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=3000, gather=64) as session:
        session.bake()
        before = session.irradiance
        session.add(new_lamp(pose=TARGET))
        session._core = InterruptedOnce(session._core)
        with pytest.raises(KeyboardInterrupt):
            session.bake()
        assert (session.irradiance != before).any()
        lit = session.energy["emitted"]
        session.update()
        assert session.energy["emitted"] == lit
        equals_recompute(session)


def test_calls_during_a_call_are_refused():
    """From the progress callback or from another thread: they would read what is being written."""
    outcomes = []

    def attempt(use):
        try:
            use()
            outcomes.append("done")
        except dl.OptionError as error:
            outcomes.append(str(error))

    scene = dl.scenes.office()
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=1), paths=50_000, gather=8) as session:

        def call(stage, fraction):
            for use in (session.update, session.digest, session.recompute, session.bake):
                attempt(use)
            thread = threading.Thread(target=attempt, args=(lambda: session.gradient,))
            thread.start()
            thread.join()

        session.progress = call
        session.bake()
        session.progress = None
        assert len(outcomes) >= 5
        assert all("another call" in outcome for outcome in outcomes)
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest


# ---- before the bake, and files -----------------------------------------------------------------


def test_edits_before_the_bake_are_saved(tmp_path):
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=1000, gather=64) as session:
        session.move("block", TARGET)
        session.remove("lamp")
        session.dim("ceiling", 0.5)
        session.save(tmp_path / "a.dlx")
        session.bake()
        with dl.Session.open(tmp_path / "a.dlx") as opened:
            np.testing.assert_array_equal(opened.pose("block"), TARGET)
            assert opened.poses["lamp"] is None
            assert opened.dim_factors["ceiling"] == 0.5
            opened.bake()
            assert opened.digest() == session.digest()


def test_a_new_bake_makes_another_builds_session_editable(baked, tmp_path):
    baked.save(tmp_path / "a.dlx")
    rewrite(tmp_path / "a.dlx", index=lambda index: index.update(built_by="another build"))
    with dl.Session.open(tmp_path / "a.dlx") as opened:
        np.testing.assert_array_equal(opened.irradiance, baked.irradiance)
        opened.move("block", TARGET)
        with pytest.raises(dl.OptionError, match="another build"):
            opened.update()
        opened.bake()
        opened.update()
        equals_recompute(opened)
        np.testing.assert_array_equal(opened.pose("block"), TARGET)


def test_recompute_of_another_builds_session_applies_what_is_queued(baked, tmp_path):
    baked.save(tmp_path / "a.dlx")
    rewrite(tmp_path / "a.dlx", index=lambda index: index.update(built_by="another build"))
    with dl.Session.open(tmp_path / "a.dlx") as opened:
        opened.move("block", TARGET)
        opened.recompute()
        opened.update()
        baked.move("block", TARGET)
        baked.update()
        assert opened.digest() == baked.digest()


@pytest.mark.parametrize(
    "options",
    [
        *({"memory_limit": bad} for bad in (0, -5, "1G", True, 1.5, float("nan"))),
        *({"max_bounces": bad} for bad in (0, 10_001)),
    ],
)
def test_limits_must_make_sense(options):
    scene = room()
    with pytest.raises(dl.OptionError, match=next(iter(options))):
        dl.Session(scene, samples_in(scene), **options)
