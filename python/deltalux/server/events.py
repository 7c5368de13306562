# SPDX-License-Identifier: Apache-2.0
"""What passes between engine and pages: the state that is wanted, and what came of it."""

from __future__ import annotations

from dataclasses import dataclass

from .edits import EditState, Key, Value
from .geometry import Geometry
from .told import News, PhaseName
from .values import Values


@dataclass(frozen=True)
class Wanted:
    """What pages asked for last."""

    state: EditState
    revision: int = 0
    dragging: bool = False
    arrival: float = 0.0  # time.perf_counter()


@dataclass(frozen=True)
class Phase:
    """What the engine does now, a `phase` of the protocol."""

    name: PhaseName


@dataclass(frozen=True)
class Refused:
    """An edit that the session refused; `value` is what it has instead."""

    key: Key
    value: Value
    message: str


@dataclass(frozen=True)
class Refined:
    """The mesh that pages draw is another one from now on."""

    geometry: Geometry


Event = Phase | Refused | Refined | Values | News  # news go to every page as they are
