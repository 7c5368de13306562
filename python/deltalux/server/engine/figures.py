# SPDX-License-Identifier: Apache-2.0
"""Live figures: what a bake, an update or a check did, as messages to pages."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from deltalux.results import Frame
from deltalux.server.protocol.told import FrameMessage
from deltalux.session import Session

REPEATED = ("trace", "deposit", "direct", "gather")  # stages of a bake that a recompute repeats


@dataclass
class Figures:
    """Figures summed over all updates since the last edit, and the speed-up.

    `recompute_milliseconds` is the time to compute the present state from scratch: measured by the last
    check, or before any check, the time of the bake's stages that a recompute repeats; None before both.
    """

    recompute_milliseconds: float | None = None
    _static_method: str | None = None
    _moving_method: str | None = None
    _milliseconds: dict[str, float] = field(default_factory=dict)
    _affected: int = 0
    _retraced: int = 0
    _gathered: int = 0
    _changed: int = 0

    def of_bake(self, session: Session, frame: Frame, revision: int, seconds: float) -> FrameMessage:
        """The `frame` message of a bake."""
        self.recompute_milliseconds = sum(frame.milliseconds.get(stage, 0.0) for stage in REPEATED)
        self.read_methods(session)
        self._start_again()
        self._add(frame, {"total": 1e3 * seconds})
        return self._message(session, revision, 1.0, None, None)

    def of_update(
        self,
        session: Session,
        frame: Frame,
        revision: int,
        *,
        fresh: bool,
        publishing: float,
        latency: float | None,
    ) -> FrameMessage:
        """The `frame` message of an update.

        Parameters
        ----------
        fresh : whether the update applied edits; otherwise it continued earlier updates
        publishing : milliseconds for reading and encoding the values
        latency : milliseconds from the newest edit's arrival to the values; None without new edits
        """
        if fresh:
            self._start_again()
        self._add(frame, {"values": publishing})
        recompute = self.recompute_milliseconds
        speed_up = recompute / self._milliseconds["total"] if recompute and frame.done == 1 else None
        return self._message(session, revision, frame.done, speed_up, latency)

    def read_methods(self, session: Session) -> None:
        """Record the methods in use, which only a bake changes."""
        parts = session.plan.parts
        discs = {name: part.chosen for name, part in parts.items() if part.samples}
        moving = dict.fromkeys(chosen for name, chosen in discs.items() if name != "static")
        self._static_method, self._moving_method = discs.get("static"), ", ".join(moving) or None

    def _start_again(self) -> None:
        self._milliseconds, self._affected, self._retraced = {}, 0, 0
        self._gathered, self._changed = 0, 0

    def _add(self, frame: Frame, more: Mapping[str, float]) -> None:
        for stage, value in (*frame.milliseconds.items(), *more.items()):
            self._milliseconds[stage] = self._milliseconds.get(stage, 0.0) + value
        self._affected += frame.affected_paths
        self._retraced += frame.retraced_segments
        self._gathered += frame.gathered_rays
        self._changed += frame.changed_rays

    def _message(
        self, session: Session, revision: int, done: float, speed_up: float | None, latency: float | None
    ) -> FrameMessage:
        statistics = session.statistics
        return {
            "type": "frame",
            "revision": revision,
            "milliseconds": dict(self._milliseconds),
            "affected_paths": self._affected,
            "paths": statistics["paths"],
            "retraced_segments": self._retraced,
            "segments": statistics["segments"],
            "gathered_rays": self._gathered,
            "changed_rays": self._changed,
            "done": done,
            "static_method": self._static_method,
            "moving_method": self._moving_method,
            "recompute_milliseconds": self.recompute_milliseconds,
            "speed_up": speed_up,
            "latency": latency,
        }
