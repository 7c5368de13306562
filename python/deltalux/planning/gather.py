# SPDX-License-Identifier: Apache-2.0
"""Predicted cost of a session's final gather: two small bakes, and interpolation between them."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux import _core
from deltalux.core_session import make_core_session
from deltalux.samples import Samples
from deltalux.scene import Mesh, Scene
from deltalux.scene.flatten import FlatScene
from deltalux.segments import Progress

from .parts import GatherPlan

PILOTS = (128, 1024)  # numbers of samples; costs that do not grow with the samples are in both
PILOT_PATHS = 50_000  # with far fewer paths, other samples would look noisy, and cast more rays
NUDGE = 1e-3  # as a share of a movable's size: as in a drag, every ray that hits it is cast again
RAYS, FIXED, BYTES = "\0rays", "\0fixed", "\0bytes"  # keys beside the names of movables
STAGES = {RAYS: ("gather",), FIXED: ("prepare", "guides")}  # of a bake


@dataclass(frozen=True)
class _Costs:
    """Costs of one pilot: seconds and bytes by purpose."""

    samples: int
    of: dict[str, float]

    def grown(self, few: _Costs, samples: int) -> dict[str, float]:
        """Extrapolate along the line through both pilots, but not below this one, the larger.

        What a bake prepares and chooses does not grow: in large scenes, it varies by more than rays cost.
        """
        if samples <= self.samples or few.samples == self.samples:
            return self.of
        ahead = (samples - self.samples) / (self.samples - few.samples)
        more = {what: max(0.0, own - few.of[what]) for what, own in self.of.items() if what != FIXED}
        return self.of | {what: self.of[what] + ahead * each for what, each in more.items()}


def plan_gather(
    scene: Scene, flat: FlatScene, samples: Samples, options: Mapping[str, Any], progress: Progress | None
) -> GatherPlan | None:
    """Predict the gather of a session with these options; None if it does not gather.

    Raises
    ------
    OptionError, SceneError, Cancelled
    """
    if options["gather"] == "off" or not len(samples):
        return None
    few, more = (_pilot(scene, flat, samples, options, count, progress) for count in PILOTS)
    costs = more.grown(few, len(samples))
    frames = {mesh.name: costs[mesh.name] for mesh in scene.meshes if mesh.movable}
    return GatherPlan(int(options["gather"]), costs[RAYS] + costs[FIXED], frames, int(costs[BYTES]))


def _pilot(
    scene: Scene,
    flat: FlatScene,
    samples: Samples,
    options: Mapping[str, Any],
    count: int,
    progress: Progress | None,
) -> _Costs:
    some = _spread(samples, count)
    own = {**options, "threads": 1, "paths": min(options["paths"], PILOT_PATHS)}
    core = make_core_session(scene, flat, some, own)
    costs = _seconds(lambda: core.bake(progress), STAGES)
    costs[BYTES] = core.statistics()["gather"]["ray_bytes_in_use"]
    for mesh in scene.meshes:
        if mesh.movable:
            costs[mesh.name] = _frame(core, flat, mesh, progress)
    return _Costs(len(some), costs)


def _seconds(work: Callable[[], Any], parts: Mapping[str, tuple[str, ...]]) -> dict[str, float]:
    """Processor seconds of parts of `work`, each some of its stages."""
    start = time.process_time()
    milliseconds = work()["milliseconds"]
    seconds = time.process_time() - start
    whole = sum(value for stage, value in milliseconds.items() if stage != "total")
    each = seconds / whole if whole > 0 else 0.0
    return {part: each * sum(milliseconds[stage] for stage in stages) for part, stages in parts.items()}


def _frame(core: Any, flat: FlatScene, mesh: Mesh, progress: Progress | None) -> float:
    """Processor seconds to update the light after moving a movable, and to read it."""
    pose = mesh.pose.copy()
    inwards = np.mean(core.world(), axis=0)[0] + flat.origin[0] - pose[0, 3]
    pose[0, 3] += np.copysign(NUDGE * float(np.ptp(mesh.vertices, axis=0).max(initial=0.0)), inwards)
    edits = _core.EditList()
    edits.move(flat.objects[mesh.name], flat.pose(mesh.name, pose))
    seconds = _seconds(lambda: core.update(edits, 0.0, progress), {RAYS: STAGES[RAYS]})[RAYS]
    start = time.process_time()
    core.read_irradiance()
    return seconds + time.process_time() - start


def _spread(samples: Samples, count: int) -> Samples:
    """About `count` of the samples, evenly distributed."""
    chosen = np.unique(np.linspace(0, len(samples) - 1, count).astype(int))
    radius = samples.radius[chosen]
    return Samples(
        samples.points[chosen],
        samples.normals[chosen],
        None if np.isnan(radius).any() else radius,
        [samples.attached[i] for i in chosen],
    )
