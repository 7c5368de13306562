# SPDX-License-Identifier: Apache-2.0
"""Rays that wait: updates with a time budget, edits on top of them, cancellation, files."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from rooms import room, translation, turn
from thoroughness import examples


@pytest.fixture(scope="module")
def baked():
    """Some twenty blocks of samples: more than one step of rays between two looks at the clock."""
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.2)
    with dl.Session(scene, samples, paths=2000, gather=16, threads=2, direct="sampled") as session:
        session.bake()
        yield session


def exact(session: dl.Session) -> None:
    digest, light = session.digest(), session.irradiance
    session.recompute()
    assert session.digest() == digest
    np.testing.assert_array_equal(session.irradiance, light)


def test_a_budget_leaves_rays_waiting(baked):
    baked.move("block", translation(0.2, 0.5, 0.3))
    frame = baked.update(budget_ms=1e-3)
    assert frame.done < 1
    assert baked.unfinished
    shares, rays = [frame.done], [frame.gathered_rays]
    while baked.unfinished:
        frame = baked.update(budget_ms=1e-3)
        shares.append(frame.done)
        rays.append(frame.gathered_rays)
    assert shares == sorted(shares)
    assert sum(count > 0 for count in rays) > 1
    exact(baked)


def test_what_is_near_comes_first():
    """What lies beside the block sees most of it. All rays of what lies on it are for the end."""
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.13)
    with dl.Session(scene, samples, paths=2000, gather=64, threads=2, direct="sampled") as session:
        session.bake()
        pose = session.pose("block")
        pose[0, 3] += 0.05
        session.move("block", pose)
        rays, unfinished = [], True
        while unfinished:
            rays.append(session.update(budget_ms=1e-3).gathered_rays)
            unfinished = session.unfinished
        own = 64 * np.count_nonzero(samples.attached == "block")
        last = np.flatnonzero(np.cumsum(rays[::-1]) >= own)[0] + 1
        assert last < len(rays) / 2
        near, far = np.array_split(rays[:-last], [32])
        assert near.mean() > 2 * far.mean()
        exact(session)


def test_what_moved_is_shown_by_few_rays_first():
    """Long before the end all that lies on the block is near to what it comes to."""
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.2)
    own = samples.attached == "block"
    with dl.Session(scene, samples, paths=2000, gather=256, threads=2, direct="sampled") as session:
        session.bake()
        light, done = [session.irradiance[own]], [0.0]
        session.move("block", translation(-0.6, 0.7, -0.2) @ turn(0.5))
        while done[-1] < 1:
            done.append(session.update(budget_ms=1e-3).done)
            light.append(session.irradiance[own])
        off = [np.sqrt(np.mean((each - light[-1]) ** 2)) / light[-1].mean() for each in light]
        half = next(i for i, each in enumerate(done) if each > 0.5)
        assert 0 < off[half] < 0.2 * off[0]
        exact(session)


def test_glances_catch_up(baked):
    """What a display is shown first where rays were cast again, then everywhere, to the bit."""

    def glance() -> np.ndarray:
        return baked.glance()[:, :3]

    def light() -> np.ndarray:
        return baked.irradiance.astype(np.float32)

    assert np.array_equal(glance(), light())
    baked.move("block", translation(0.3, 0.6, 0.1))
    assert baked.update().gathered_rays
    first = glance()
    assert np.array_equal(*(values[baked.samples.attached == "block"] for values in (first, light())))
    assert 0 < np.mean(np.any(first != light(), axis=1)) < 7 / 8
    for _ in range(7):
        shown = glance()
    assert np.array_equal(shown, light())
    # What shows everywhere is read everywhere, also where something moves along with it.
    baked.set_reflectance("wall", (0.3, 0.4, 0.5))
    baked.move("block", translation(0.2, 0.6, 0.1))
    baked.update()
    assert np.array_equal(glance(), light())
    # What a display was shown as a whole in between is what the next glance goes on from.
    baked.move("block", translation(0.5, 0.6, 0.1))
    baked.update()
    assert np.array_equal(baked.read_packed(errors=False)[:, :3], light())
    assert np.array_equal(glance(), light())
    exact(baked)


NAMES = st.sampled_from(["block", "lamp"])
EDITS = st.one_of(
    st.tuples(NAMES, st.floats(-1.2, 1.2), st.floats(0.4, 1.4), st.floats(-0.8, 0.8)),
    st.tuples(NAMES, st.sampled_from(["remove", "add"])),
    st.tuples(st.just("paint"), st.floats(0, 0.9)),
)


@settings(max_examples=examples(15), deadline=None)
@given(edits=st.lists(st.tuples(EDITS, st.sampled_from([None, 1e-3, 2.0])), min_size=1, max_size=6))
def test_edits_on_top_of_waiting_rays_are_exact(baked, edits):
    for (name, *values), budget in edits:
        if values[0] in ("remove", "add"):
            if (baked.poses[name] is None) == (values[0] == "add"):
                getattr(baked, values[0])(name)
        elif name == "paint":
            baked.set_reflectance("wall", (values[0],) * 3)
        elif baked.poses[name] is not None:
            baked.move(name, translation(*values))
        baked.update(budget_ms=budget)
    exact(baked)


def test_files_of_waiting_rays_are_whole(baked, tmp_path):
    for name in ("block", "lamp"):
        if baked.poses[name] is None:
            baked.add(name)
    baked.update()
    baked.move("block", translation(0.5, 0.8, -0.3))
    baked.update(budget_ms=1e-3)
    assert baked.unfinished
    baked.save(tmp_path / "waiting.dlx")
    with dl.Session.open(tmp_path / "waiting.dlx") as opened:
        exact(opened)
        exact(baked)
        np.testing.assert_array_equal(opened.irradiance, baked.irradiance)


def test_cancelled_rays_are_cast_by_the_next_update(baked):
    def stop(stage: str, fraction: float) -> bool:
        return stage != "cast gather rays"

    if baked.poses["block"] is None:
        baked.add("block")
    baked.move("block", translation(-0.4, 0.5, 0.4))
    baked.progress = stop
    try:
        baked.update()
    except dl.Cancelled:
        pass
    finally:
        baked.progress = None
    exact(baked)
