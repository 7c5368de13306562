# SPDX-License-Identifier: Apache-2.0
"""Messages between engine and pages: the wanted state, and events that result from it."""

from __future__ import annotations

from dataclasses import dataclass

from deltalux.server.drawn.geometry import Geometry
from deltalux.server.drawn.values import Values
from deltalux.server.edits import EditState, Key, Value
from deltalux.server.protocol.told import News, PhaseName

from .known import Known
from .remaking import Remake


@dataclass(frozen=True)
class Wanted:
    """The newest request of the pages."""

    state: EditState
    revision: int = 0
    dragging: bool = False
    arrival: float = 0.0  # time.perf_counter()


@dataclass(frozen=True)
class Phase:
    """What the engine is doing, a `phase` of the protocol."""

    name: PhaseName


@dataclass(frozen=True)
class Refused:
    """An edit that the session refused; `value` is the value that it has instead."""

    key: Key
    value: Value
    message: str


@dataclass(frozen=True)
class Refined:
    """From now on pages draw this mesh."""

    geometry: Geometry


@dataclass(frozen=True)
class Remade:
    """Another version of the scene was baked."""

    known: Known
    geometry: Geometry | None  # what pages draw from now on
    remake: Remake


Event = Phase | Refused | Refined | Remade | Values | News  # news are sent to every page unchanged
