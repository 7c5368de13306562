# SPDX-License-Identifier: Apache-2.0
"""Share done and time left of a job of many steps: forecasts, corrected by how long steps really take."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass

TRUST = 0.3  # of the forecasts: as of a step that took this much of a second as foreseen
HALF_TOLD = 1.0  # seconds: a step this long tells half of what a long one tells
ALIKE = {True: 1.0, False: 0.15}  # how much a step tells of one of the same kind, and of another
PARALLEL = frozenset({"rays", "shadows", "paths"})
ALONE = frozenset({"edit", "once"})  # what takes its time whatever the rest does
BOTH_PARALLEL = 0.4  # of steps of different kinds which processors share
SHORT = 0.1  # seconds: shorter steps tell nothing
EARLY = 0.07  # of a step: so much of it done is as good a guide to its length as the forecast
OVERDUE = 0.15  # of its time so far: what a step that should be over still takes


@dataclass(frozen=True)
class Step:
    """A step of a job.

    Parameters
    ----------
    name : as callbacks report it, or `Overall.begin` says it
    seconds : forecast; only ratios matter once some steps are done
    kind : steps of one kind are slower or faster than foreseen together; "edit", what depends on what
        an edit touches, and "once" tell nothing of other kinds
    parts : stages that are reported within it
    """

    name: str
    seconds: float
    kind: str = "python"
    parts: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Estimate:
    """What is known of a job at an instant.

    Attributes
    ----------
    stage : name of the present step
    share : of the work that is done, 0 to 1; never falls
    elapsed, remaining : seconds; `remaining` is None where nothing is foreseen
    """

    stage: str
    share: float
    elapsed: float
    remaining: float | None


@dataclass(frozen=True)
class _Told:
    """What a step told about its kind: the logarithm of its time over its forecast."""

    kind: str
    slowness: float
    weight: float


class Overall:
    """Overall progress of a job whose steps are foreseen: a progress callback (stage, fraction).

    Can be given as `progress` to whatever takes such a callback; `state` tells share and time left at any
    time and from any thread, also while nothing is reported.

    Parameters
    ----------
    steps : in the order in which they come; some may not come
    clock : seconds
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
        self.unforeseen: list[str] = []  # stages that no step is for

    def expect(self, steps: Iterable[Step]) -> None:
        """From now on these steps follow the present one."""
        with self._lock:
            self._ahead = list(steps)

    def revise(self, steps: Iterable[Step]) -> None:
        """The next steps of these names are foreseen anew; nothing is added."""
        with self._lock:
            names = [step.name for step in self._ahead]
            for step in steps:
                if step.name in names:
                    self._ahead[names.index(step.name)] = step

    def begin(self, name: str) -> None:
        """The step of this name begins; for those that report nothing themselves."""
        with self._lock:
            if not self._enter(name):
                self._note(name)
                self._leave()
                self._now = Step(name, 1e-3, "unforeseen")

    def end(self) -> None:
        """All is done."""
        with self._lock:
            self._leave()
            self._ahead, self._now, self._ended = [], None, True

    def __call__(self, stage: str, fraction: float) -> bool:
        """Hear of a stage; never asks to stop."""
        with self._lock:
            own = self._now is not None and self._now.name == stage
            if stage and not own:
                own = self._enter(stage)
                if not own and stage not in self._passed:
                    self._note(stage)
            if own:
                self._fraction = max(self._fraction, min(fraction, 1.0))
        return True

    def state(self) -> Estimate:
        """What is known now."""
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
        """Go on to the next step of this name; those before it did not come."""
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
    """How much slower than foreseen steps of a kind are likely to be."""
    weights = [_likeness(kind, one.kind) * one.weight for one in told]
    known = sum(weight * one.slowness for weight, one in zip(weights, told, strict=True))
    return math.exp(known / (sum(weights) + TRUST))


def _likeness(kind: str, other: str) -> float:
    if kind != other and not ALONE.isdisjoint((kind, other)):
        return 0.0
    if kind != other and kind in PARALLEL and other in PARALLEL:
        return BOTH_PARALLEL
    return ALIKE[kind == other]
