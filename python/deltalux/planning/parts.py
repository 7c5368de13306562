# SPDX-License-Identifier: Apache-2.0
"""Plans: cost of each disc method and the gather in a session, the choice, and its reason in words."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from deltalux import _core

STATIC = "static"
NO_OBJECT = 0xFFFFFFFF
POLICIES = ("measured", "paper-sphere", "paper-box")
PAPER_SIZE = _core.PAPER_SIZE  # r_D / r_0 of Theorem 2
INDEX = "disc_index"


@dataclass(frozen=True)
class MethodPlan:
    """Cost of one method in one part, in processor seconds.

    Attributes
    ----------
    method : "brute_force", "disc_index", "ray_map" or "sphere_cache"
    build_seconds : to build the index, or to sort the samples into visiting order
    bake_seconds : to find the crossings of all the bake's segments with the samples' discs
    frame_seconds : to find those of a frame's segments, with the existing estimator
    bytes : memory in addition to segments, samples and sums
    piloted : False if lower bounds showed without a pilot that the method cannot save a tenth; seconds and
        counts are then these bounds
    bake_counts, frame_counts : predicted tests by kind
    """

    method: str
    build_seconds: float
    bake_seconds: float
    frame_seconds: float
    bytes: int
    piloted: bool
    bake_counts: Mapping[str, float]
    frame_counts: Mapping[str, float]

    def figures(self) -> tuple[str, str, str]:
        """Times to build, bake and update, for readers; ≥ marks lower bounds."""
        least = "" if self.piloted else "≥ "
        return (
            duration(self.build_seconds),
            least + duration(self.bake_seconds),
            least + duration(self.frame_seconds),
        )

    def seconds(self, frames: float, rebuild: bool = False) -> float:
        """Build, bake and so many frames; with `rebuild`, each frame builds again."""
        frame = self.frame_seconds + (self.build_seconds if rebuild else 0.0)
        return self.build_seconds + self.bake_seconds + frames * frame


@dataclass(frozen=True)
class PartPlan:
    """The plan of the static samples, or of those on one movable.

    Attributes
    ----------
    part : "static", or the movable's name
    samples : number of samples
    bake_segments : segments that the bake processes in this part, approximately
    frame_segments : segments that a frame in which an object moves adds to it, approximately
    frames : number of such frames that the choice assumes
    size_by_sphere, size_by_box : size of the movable over that of the scene, by radii of spheres and
        diagonals of boxes; 0 for the static part
    chosen : the chosen method
    reason : the reason, in words
    methods : costs, the cheapest first; empty if the user chose the method
    """

    part: str
    samples: int
    bake_segments: float
    frame_segments: float
    frames: float
    size_by_sphere: float
    size_by_box: float
    chosen: str
    reason: str
    methods: Sequence[MethodPlan]

    def method(self, name: str) -> MethodPlan:
        """The costs of a method; KeyError if they are not known."""
        for method in self.methods:
            if method.method == name:
                return method
        raise KeyError(name)

    @property
    def all_piloted(self) -> bool:
        """Whether the costs of all methods are known; without a pilot only lower bounds are known."""
        return bool(self.methods) and all(m.piloted for m in self.methods)

    @property
    def pays_after(self) -> float | None:
        """Frames after which the disc index, built once, has cost less than any method without an index.

        0: within the bake. None: never, by the predicted seconds, or not known. This is for an index that is
        kept; an index that each frame builds again has no such number.
        """
        if not self.all_piloted:
            return None
        index = self.method(INDEX)
        frames = [_frames_until_cheaper(index, other) for other in self.methods if other.method != INDEX]
        return max(frames) if all(math.isfinite(f) for f in frames) else None


@dataclass(frozen=True)
class GatherPlan:
    """Cost of the gather, in processor seconds.

    Attributes
    ----------
    rays : rays per sample; samples with noisy light cast more
    bake_seconds : to divide surfaces into cells, to find bright places and to cast all rays
    frame_seconds : by movable: to cast again the rays that the next step of a drag changes, and to read light
    bytes : memory of all rays and their hits
    """

    rays: int
    bake_seconds: float
    frame_seconds: Mapping[str, float]
    bytes: int

    def __str__(self) -> str:
        frames = "".join(
            f", a step of {name} {duration(seconds)}" for name, seconds in self.frame_seconds.items()
        )
        bake = duration(self.bake_seconds)
        return f"{self.rays} rays of each sample: bake {bake}{frames}, {self.bytes / 2**20:.1f} MB"


@dataclass(frozen=True)
class Plan:
    """Result of `dl.plan`.

    Attributes
    ----------
    parts : by name, "static" first
    policy : "measured", "paper-sphere" or "paper-box"
    rebuild : whether each frame rebuilds the estimators of movables
    milliseconds : time of planning, without calibration; 0 in a session, whose bake reports its stages
    gather : cost of the gather; None if the session does not gather, and in a session
    paths : paths of the bake; 0 in a session, whose options tell
    """

    parts: Mapping[str, PartPlan]
    policy: str = "measured"
    rebuild: bool = False
    milliseconds: float = 0.0
    gather: GatherPlan | None = None
    paths: int = 0

    def as_dict(self) -> dict[str, Any]:
        """JSON values."""
        parts = {
            name: asdict(part)
            | {
                "methods": [asdict(method) for method in part.methods],
                "pays_after": None if self.rebuild else part.pays_after,
            }
            for name, part in self.parts.items()
        }
        return {
            "policy": self.policy,
            "rebuild": self.rebuild,
            "milliseconds": self.milliseconds,
            "paths": self.paths,
            "parts": parts,
            "gather": asdict(self.gather) if self.gather else None,
        }

    def __str__(self) -> str:
        lines = []
        for part in self.parts.values():
            lines.append(f"{part.part}: {part.samples:,} samples, {part.bake_segments:,.0f} segments")
            lines.append(f"  {'method':<14}{'build':>11}{'bake':>11}{'frame':>11}{'memory':>11}")
            for method in part.methods:
                lines.append(
                    f"{'> ' if method.method == part.chosen else '  '}{method.method:<14}"
                    + "".join(f"{text:>11}" for text in method.figures())
                    + f"{method.bytes / 2**20:>8.1f} MB"
                )
            lines.append(f"  {part.chosen}: {part.reason}")
        if self.gather:
            lines.append(f"gather: {self.gather}")
        return "\n".join(lines)


def duration(seconds: float) -> str:
    """A duration in readable units."""
    for unit, size in (("s", 1.0), ("ms", 1e-3), ("µs", 1e-6)):
        if seconds >= size:
            return f"{seconds / size:.3g} {unit}"
    return f"{seconds / 1e-9:.3g} ns"


def _frames_until_cheaper(index: MethodPlan, other: MethodPlan) -> float:
    ahead = index.seconds(0) - other.seconds(0)
    if ahead <= 0 and index.frame_seconds <= other.frame_seconds:
        return 0.0
    saved = other.frame_seconds - index.frame_seconds
    return math.ceil(max(0.0, ahead) / saved) if saved > 0 else math.inf


def read_plan(
    parts: Sequence[Mapping[str, Any]],
    names: Mapping[int, str],
    asked: Mapping[bool, str],
    policy: str,
    rebuild: bool,
    milliseconds: float,
) -> Plan:
    """A plan of the core, with reasons in words.

    Parameters
    ----------
    parts : as returned by the core
    names : of movables, by number
    asked : the user's choice of the static method under False, of the moving method under True
    policy, rebuild, milliseconds : see `Plan`
    """
    found = {}
    for part in parts:
        moving = part["object"] != NO_OBJECT
        name = names[part["object"]] if moving else STATIC
        methods = [MethodPlan(**{**method, "bytes": int(method["bytes"])}) for method in part["methods"]]
        found[name] = PartPlan(
            name,
            int(part["discs"]),
            part["bake_segments"],
            part["frame_segments"],
            part["frames"],
            part["size_by_sphere"],
            part["size_by_box"],
            part["chosen"],
            _reason(part, methods, asked[moving], policy, rebuild),
            methods,
        )
    return Plan(found, policy, rebuild, milliseconds)


def _reason(
    part: Mapping[str, Any], methods: Sequence[MethodPlan], asked: str, policy: str, rebuild: bool
) -> str:
    if asked != "auto":
        return "asked for"
    if part["discs"] == 0:
        return "no disc has light to count"
    if policy != "measured":
        return _paper_reason(part, policy)
    frames = part["frames"]
    total = {m.method: m.seconds(frames, rebuild) for m in methods}
    own = total[part["chosen"]]
    work = "the bake" if frames == 0 else f"the bake and {frames:g} frames"
    if rebuild:
        work += ", each with a rebuild"
    text = f"{duration(own)} for {work}"
    others = [m for m in methods if m.method != part["chosen"] and m.piloted]
    if len(others) < len(methods) - 1:
        return f"{text}; methods without a pilot cannot save a tenth of that"
    if others and own > 0:
        second = min(others, key=lambda m: total[m.method])
        times = total[second.method] / own
        if times < 1:
            return f"{text}; {second.method}, predicted at {times:.0%}, searches no faster than an index"
        text += f"; next is {second.method}, {times:.3g} times as much"
    return text


def _paper_reason(part: Mapping[str, Any], policy: str) -> str:
    if part["object"] == NO_OBJECT:
        return "paper, Theorem 2: static samples take the disc index"
    size = part["size_by_sphere" if policy == "paper-sphere" else "size_by_box"]
    what = "sphere" if policy == "paper-sphere" else "box"
    side = "below" if size < PAPER_SIZE else "not below"
    return f"paper, Theorem 2: its {what} is {size:.0%} of the scene's, {side} {PAPER_SIZE:.0%}"
