# SPDX-License-Identifier: Apache-2.0
"""`dl.plan`: the cost of every method in every part of a session, before it is baked."""

from __future__ import annotations

import time
from dataclasses import replace

from deltalux.core_session import (
    SessionOptions,
    checked_options,
    default_paths,
    make_core_session,
    resolved_gather,
)
from deltalux.errors import OptionError
from deltalux.estimate.inputs import check_choice
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.scene.flatten import flatten
from deltalux.segments import MAX_BOUNCES, Progress

from .gather import plan_gather
from .machine import machine_constants
from .parts import POLICIES, Plan, read_plan


def plan(
    scene: Scene,
    samples: Samples | None = None,
    *,
    paths: int | None = None,
    seed: int = 1,
    threads: int | None = None,
    segment_end: str = "first",
    disc_area: str = "reachable",
    direct: str = "auto",
    max_bounces: int = MAX_BOUNCES,
    gather: str | int = "auto",
    policy: str = "measured",
    frames: float | None = None,
    rebuild: bool = False,
    progress: Progress | None = None,
) -> Plan:
    """Predict the cost of every disc method and of the gather in a session, and choose a method per part.

    A pilot traces 8192 of the session's paths and passes their segments to each method at full depth;
    counts of tests, scaled up, are multiplied by constants calibrated on this machine. If the session
    would gather, two small bakes measure its cost.

    Parameters
    ----------
    scene, samples, paths, seed, threads, segment_end, disc_area, direct, max_bounces, gather
        As in `Session`.
    policy : "measured", "paper-sphere" or "paper-box"
        Choose by predicted seconds, or by the paper's Theorem 2: disc index for static samples, sphere
        cache for a movable below 35 % of the scene, by their spheres' radii or their boxes' diagonals.
    frames : frames, each moving one object, that follow the bake; None = 100 if there are movables
    rebuild : plan as if every frame rebuilt its estimators, as in the paper; a session never does
    progress : callable (stage, fraction) -> False to cancel

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
    samples = Samples.on_vertices(scene) if samples is None else samples
    gather = resolved_gather(gather, len(samples), segment_end, disc_area)
    given = SessionOptions(
        paths=default_paths(gather) if paths is None else paths,
        seed=seed,
        threads=threads,
        segment_end=segment_end,
        disc_area=disc_area,
        direct=direct,
        static_method="auto",
        moving_method="auto",
        max_bounces=max_bounces,
        memory_limit=None,
        gather=gather,
        path_range=None,
    )
    options = checked_options(given)
    flat = flatten(scene)
    core = make_core_session(scene, flat, samples, options | {"gather": "off"})
    core.set_planning(machine_constants(progress), policy, frames, rebuild)
    start = time.perf_counter()
    parts = core.plan(progress)
    elapsed = 1e3 * (time.perf_counter() - start)
    names = {number: name for name, number in flat.objects.items()}
    found = read_plan(parts, names, {False: "auto", True: "auto"}, policy, rebuild, elapsed)
    gathered = plan_gather(scene, flat, samples, options, progress)
    return replace(found, gather=gathered, paths=options["paths"])
