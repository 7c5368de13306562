# SPDX-License-Identifier: Apache-2.0
"""The overall bar's estimate: right about what is foreseen, soon right about what is not."""

from __future__ import annotations

import re
from collections.abc import Callable, Sequence
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.pace import (
    Counts,
    Overall,
    Step,
    Stored,
    baking,
    drawing,
    loading,
    opening,
    summing_up,
    updating,
    writing,
)
from lit_scenes import pools_and_sconce
from oracles import world

ROOT = Path(__file__).parents[3]
HALF = 0.5
OFFICE = Counts(14_590, 58_099, 300_000, 256, lights=7)


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def played(
    steps: Sequence[Step], seconds: Callable[[Step], float], linear: bool = True
) -> tuple[Overall, np.ndarray]:
    """A job whose steps take `seconds`, and rows of (time, time left as told, share)."""
    clock = Clock()
    overall = Overall(steps, clock)
    rows = []
    for step in steps:
        overall.begin(step.name)
        length = seconds(step)
        for i in range(200):
            if linear:
                overall(step.name, i / 200)
            state = overall.state()
            rows.append((clock.now, state.remaining, state.share))
            clock.now += length / 200
    overall.end()
    return overall, np.array(rows)


def share_within(rows: np.ndarray) -> float:
    """Of the time between a tenth and nine tenths, how much of it the time left was off by at most half."""
    start, end = rows[0, 0], rows[-1, 0]
    instants = np.linspace(start + 0.1 * (end - start), start + 0.9 * (end - start), 500)
    row = np.searchsorted(rows[:, 0], instants, side="right") - 1
    return float((np.abs(rows[row, 1] / (end - instants) - 1) <= HALF).mean())


def full_bake() -> list[Step]:
    return [
        *loading(OFFICE),
        *baking(OFFICE),
        *writing(OFFICE, [".dlx", ".png", ".glb"]),
        *summing_up(OFFICE),
    ]


@pytest.mark.parametrize("linear", [True, False])
def test_forecasts_that_are_right_are_told(linear):
    _, rows = played(full_bake(), lambda step: step.seconds, linear)
    assert share_within(rows) == 1.0
    np.testing.assert_allclose(rows[0, 1], rows[-1, 0] - rows[0, 0], rtol=0.02)


@pytest.mark.parametrize("slower", [0.3, 3.0])
def test_a_machine_of_another_speed_is_found_out(slower):
    _, rows = played(full_bake(), lambda step: slower * step.seconds)
    assert share_within(rows) > 0.9


@pytest.mark.parametrize("factor", [0.4, 2.5])
def test_a_scene_of_dearer_rays_is_found_out(factor):
    of_rays = ("rays", "shadows")
    _, rows = played(full_bake(), lambda step: step.seconds * (factor if step.kind in of_rays else 1))
    assert share_within(rows) > 0.9


def test_steps_that_do_not_come_are_taken_off():
    clock = Clock()
    overall = Overall([Step("one", 1), Step("two", 50), Step("three", 1)], clock)
    overall("one", 0.0)
    assert 51 <= overall.state().remaining <= 53
    clock.now += 1
    overall("three", 0.0)
    assert overall.state().remaining == pytest.approx(1, rel=0.3)
    assert overall.unforeseen == []


def test_the_share_never_falls_and_ends_at_one():
    steps = [Step("short", 1), Step("long", 1)]
    overall, rows = played(steps, lambda step: {"short": 1, "long": 60}[step.name])
    assert (np.diff(rows[:, 2]) >= 0).all()
    assert overall.state().share == 1.0
    assert overall.state().remaining == 0.0


def test_time_goes_on_where_nothing_is_reported():
    clock = Clock()
    overall = Overall([Step("silent", 10), Step("after", 10)], clock)
    overall.begin("silent")
    told = []
    for _ in range(30):
        clock.now += 1
        told.append(overall.state())
    assert (np.diff([state.share for state in told[:9]]) > 0).all()
    assert all(state.remaining > 9 for state in told)  # what comes after it is not forgotten
    assert told[-1].elapsed == 30


def test_what_an_edit_touches_tells_nothing_of_other_steps():
    clock = Clock()
    overall = Overall([Step("update", 0.1, "edit"), Step("draw", 10, "rays")], clock)
    overall.begin("update")
    clock.now += 20
    overall.begin("draw")
    assert overall.state().remaining == pytest.approx(10)


def test_unforeseen_stages_are_noted():
    overall = Overall([Step("known", 1, parts=frozenset({"part"}))])
    for stage in ("known", "part", "", "new", "new"):
        overall(stage, 0.5)
    overall.begin("newer")
    assert overall.unforeseen == ["new", "newer"]


@pytest.mark.usefixtures("reports_at_once")
def test_steps_are_in_the_order_in_which_a_bake_reports_them():
    """Of a busy machine's bakes each may pass over a step that is short; what is told is in order."""
    scene = pools_and_sconce()
    samples = dl.Samples(*world.area_points(scene, 200, seed=5))
    foreseen = [step.name for step in baking(OFFICE)]
    missing = {"share rays", "find noisy places", "cast gather rays"}
    for _ in range(30):
        heard: list[str] = []
        with dl.Session(scene, samples, paths=5_000, gather=64, threads=1) as session:
            session.progress = lambda stage, _, heard=heard: heard.append(stage) or True
            session.bake()
        reported = [stage for stage in dict.fromkeys(heard) if stage in foreseen]
        assert reported == sorted(reported, key=foreseen.index)
        missing -= set(reported)
        if not missing:
            break
    assert not missing


def test_every_stage_of_the_engine_has_a_step():
    sources = [path for part in ("session", "gather", "direct", "samples", "plan", "trace")
               for path in (ROOT / "core" / part).rglob("*.cpp")]  # fmt: skip
    found = {name for path in sources
             for name in re.findall(r'(?:begin|announce)\("([^"]+)"', path.read_text())}  # fmt: skip
    assert len(found) > 15
    counts = Counts(1000, suns=1)
    steps = [
        *opening(Stored(counts, 1e6, 1e5)),
        *baking(counts),
        *baking(Counts(1000, rays=0)),
        *updating(counts),
        *drawing(counts),
    ]
    known = {step.name for step in steps} | {part for step in steps for part in step.parts}
    # `Session.gradient`, which no command asks for; an update that ran out of memory.
    assert found - known == {"deposit", "compute again"}
