# SPDX-License-Identifier: Apache-2.0
"""Progress and time left of a job of many steps: forecasts, corrected by the times of finished steps."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

TRUST = 0.3  # weight of the forecasts, as of a measured step that took exactly its forecast
HALF_TOLD = 1.0  # seconds: a measured step of this length has half the weight of a long one
ALIKE = {True: 1.0, False: 0.15}  # weight of a measured step for steps of its own kind, and of other kinds
PARALLEL = frozenset({"rays", "shadows", "paths"})
ALONE = frozenset({"edit", "once"})  # kinds that neither inform other kinds nor learn from them
BOTH_PARALLEL = 0.4  # weight between different kinds in PARALLEL
SHORT = 0.1  # seconds added to time and forecast, so that shorter steps count little
EARLY = 0.07  # share of a step at which its own progress weighs as much as its forecast
OVERDUE = 0.15  # least time left of an unfinished step, as a share of its time so far


@dataclass(frozen=True)
class Step:
    """A step of a job.

    Parameters
    ----------
    name : the stage that callbacks report, or the argument of `Overall.begin`
    seconds : forecast; once some steps are done, only the ratios between forecasts matter
    kind : steps of one kind are assumed to deviate from their forecasts by a common factor; "edit" (times
        that depend on what an edit touches) and "once" give no information about other kinds
    parts : stages that are reported within the step
    """

    name: str
    seconds: float
    kind: str = "python"
    parts: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Estimate:
    """State of a job at one instant.

    Attributes
    ----------
    stage : name of the current step
    share : share of the work that is done, 0 to 1; never decreases
    elapsed, remaining : seconds; `remaining` is None without forecasts
    """

    stage: str
    share: float
    elapsed: float
    remaining: float | None


@dataclass(frozen=True)
class _Told:
    """Measurement of one step: logarithm of its time over its forecast, and the weight of that."""

    kind: str
    slowness: float
    weight: float


class Overall:
    """Overall progress of a job with forecast steps; itself a progress callback (stage, fraction).

    Pass it as `progress` to any function with such a callback. `state` returns share and time left at any
    time and from any thread, even between reports.

    Parameters
    ----------
    steps : in order; some may be skipped
    clock : function that returns the time in seconds

    Attributes
    ----------
    on_step : called whenever another step has begun, so that even the shortest is shown
    unforeseen : reported stages that belong to no step
    """

    def __init__(self, steps: Iterable[Step] = (), clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._ahead = list(steps)
        self._passed: set[str] = set()
        self._told: list[_Told] = []
        self._start = self._since = clock()
        self._now: Step | None = None
        self._fraction = self._share = 0.0
        self._ended = False
        self.unforeseen: list[str] = []
        self.on_step: Callable[[], None] = lambda: None

    def expect(self, steps: Iterable[Step]) -> None:
        """Replace the steps that follow the current one."""
        with self._lock:
            self._ahead = list(steps)

    def revise(self, steps: Iterable[Step]) -> None:
        """Replace the forecasts of the next steps of the same names; adds no step."""
        with self._lock:
            names = [step.name for step in self._ahead]
            for step in steps:
                if step.name in names:
                    self._ahead[names.index(step.name)] = step

    def begin(self, name: str) -> None:
        """Begin the step of this name; for steps that report no progress themselves."""
        with self._lock:
            if not self._enter(name):
                self._note(name)
                self._leave()
                self._now = Step(name, 1e-3, "unforeseen")
        self.on_step()

    def end(self) -> None:
        """Mark the job as finished."""
        with self._lock:
            self._leave()
            self._ahead, self._now, self._ended = [], None, True

    def __call__(self, stage: str, fraction: float) -> bool:
        """Record the progress of a stage; returns True, hence never cancels."""
        with self._lock:
            own = self._now is not None and self._now.name == stage
            begun = bool(stage) and not own and self._enter(stage)
            if stage and not own and not begun and stage not in self._passed:
                self._note(stage)
            if own or begun:
                self._fraction = max(self._fraction, min(fraction, 1.0))
        if begun:
            self.on_step()
        return True

    def state(self) -> Estimate:
        """The current state of the job."""
        with self._lock:
            elapsed = self._clock() - self._start
            if self._ended:
                return Estimate("", 1.0, elapsed, 0.0)
            name = self._now.name if self._now else ""
            if not self._now and not self._ahead:
                return Estimate(name, 0.0, elapsed, None)
            left = self._left()
            self._share = max(self._share, elapsed / max(1e-9, elapsed + left))
            return Estimate(name, self._share, elapsed, left)

    def _note(self, stage: str) -> None:
        if stage not in self.unforeseen:
            self.unforeseen.append(stage)

    def _enter(self, name: str) -> bool:
        """Go on to the next step of this name, skipping those before it; False if there is none."""
        for i, step in enumerate(self._ahead):
            if step.name == name:
                self._leave()
                for passed in self._ahead[: i + 1]:
                    self._passed |= {passed.name, *passed.parts}
                self._now, self._ahead = step, self._ahead[i + 1 :]
                return True
        return False

    def _leave(self) -> None:
        now = self._clock()
        if self._now:
            self._told += self._tell(self._now, now - self._since, 1.0)
        self._since, self._fraction = now, 0.0

    def _tell(self, step: Step, seconds: float, trust: float) -> list[_Told]:
        longer = max(seconds, step.seconds)
        if step.kind == "unforeseen" or longer <= 0:
            return []
        ratio = (seconds + SHORT) / (step.seconds + SHORT)
        return [_Told(step.kind, math.log(ratio), trust * longer / (longer + HALF_TOLD))]

    def _left(self) -> float:
        told, left = self._told, 0.0
        if self._now:
            spent, done = self._clock() - self._since, self._fraction
            foreseen = self._now.seconds * _pace(self._now.kind, told)
            total = foreseen
            if done > 0:
                told_by_itself = done / (done + EARLY)
                total = math.exp(
                    (1 - told_by_itself) * math.log(max(foreseen, spent, 1e-6))
                    + told_by_itself * math.log(max(spent, 1e-6) / done)
                )
                told = told + self._tell(self._now, total, told_by_itself)
            elif spent > foreseen:
                told = told + self._tell(self._now, spent, 1.0)
            left = max(total - spent, OVERDUE * spent if done < 1 else 0.0)
        return left + sum(step.seconds * _pace(step.kind, told) for step in self._ahead)


def _pace(kind: str, told: list[_Told]) -> float:
    """Expected ratio of time to forecast for steps of a kind, from the measurements `told`."""
    weights = [_likeness(kind, one.kind) * one.weight for one in told]
    known = sum(weight * one.slowness for weight, one in zip(weights, told, strict=True))
    return math.exp(known / (sum(weights) + TRUST))


def _likeness(kind: str, other: str) -> float:
    if kind != other and not ALONE.isdisjoint((kind, other)):
        return 0.0
    if kind != other and kind in PARALLEL and other in PARALLEL:
        return BOTH_PARALLEL
    return ALIKE[kind == other]
