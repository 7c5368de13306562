# SPDX-License-Identifier: Apache-2.0
"""`dl.plan`: the cost of every method in every part of a session, before it is baked."""

from __future__ import annotations

import time

from deltalux.core_session import SessionOptions, checked_options, make_core_session
from deltalux.errors import OptionError
from deltalux.estimate.inputs import check_choice
from deltalux.flatten import flatten
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import MAX_BOUNCES, Progress

from .machine import machine_constants
from .parts import POLICIES, Plan, read_plan


def plan(
    scene: Scene,
    samples: Samples | None = None,
    *,
    paths: int = 1_000_000,
    seed: int = 1,
    threads: int | None = None,
    segment_end: str = "first",
    disc_area: str = "reachable",
    direct: str = "auto",
    max_bounces: int = MAX_BOUNCES,
    policy: str = "measured",
    frames: float | None = None,
    rebuild: bool = False,
    progress: Progress | None = None,
) -> Plan:
    """Predict what every disc method would cost in a session, and choose one per part.

    A pilot walks 8192 of the session's paths and brings their segments to each method at full depth;
    counts of tests, scaled up, are multiplied by constants that were calibrated on this machine.

    Parameters
    ----------
    scene, samples, paths, seed, threads, segment_end, disc_area, direct, max_bounces
        As of `Session`.
    policy : "measured", "paper-sphere" or "paper-box"
        Choose by predicted seconds, or by the paper's Theorem 2: disc index for static samples, sphere
        cache for a movable below 35 % of the scene, by their spheres' radii or their boxes' diagonals.
    frames : frames, each moving one object, that follow the bake; None = 100 if anything can move
    rebuild : plan as if every frame built its estimators again, as the paper does; a session never does
    progress : callable (stage, fraction) -> keep going

    Returns
    -------
    Plan
        `print(plan)` shows it as a table.

    Raises
    ------
    OptionError, SceneError, Cancelled
    """
    check_choice("policy", policy, POLICIES)
    if frames is not None and not 0 <= frames < 1e12:
        raise OptionError(f"frames: found {frames!r}, expected a number from 0, below 1e12, or None")
    given = SessionOptions(
        paths=paths,
        seed=seed,
        threads=threads,
        segment_end=segment_end,
        disc_area=disc_area,
        direct=direct,
        static_method="auto",
        moving_method="auto",
        max_bounces=max_bounces,
        memory_limit=None,
        gather="off",
    )
    options = checked_options(given)
    samples = Samples.on_vertices(scene) if samples is None else samples
    flat = flatten(scene)
    core = make_core_session(scene, flat, samples, options)
    core.set_planning(machine_constants(progress), policy, frames, rebuild)
    start = time.perf_counter()
    parts = core.plan(progress)
    elapsed = 1e3 * (time.perf_counter() - start)
    names = {number: name for name, number in flat.objects.items()}
    return read_plan(parts, names, {False: "auto", True: "auto"}, policy, rebuild, elapsed)
