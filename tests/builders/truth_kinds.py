# SPDX-License-Identifier: Apache-2.0
"""All kinds of random scenes, and each scene as a function of (seed, number)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from . import truth_indoors, truth_outdoors
from .truth_draft import Draft, Truth

POINTS = 48
Kind = Callable[[Draft, np.random.Generator], None]

KINDS: dict[str, Kind] = {
    "site_lamp": truth_outdoors.site_lamp,
    "site_sun": truth_outdoors.site_sun,
    "ratio": truth_indoors.ratio,
    "opening": truth_indoors.opening,
    "joined": truth_indoors.joined,
    "doubled": truth_indoors.doubled,
    "terrain": truth_outdoors.terrain,
    "white": truth_indoors.white,
    "dome": truth_outdoors.dome,
    "furnished": truth_indoors.furnished,
    "hall": truth_indoors.hall,
    "bulb": truth_indoors.bulb,
}


def kind_of(number: int) -> str:
    """Kinds take turns."""
    return list(KINDS)[number % len(KINDS)]


def truth_scene(seed: int, number: int, points: int = POINTS) -> Truth:
    """Scene `number` of those of `seed`, with its light asked for at `points` places."""
    kind, rng = kind_of(number), np.random.default_rng([seed, number])
    draft = Draft()
    KINDS[kind](draft, rng)
    return draft.finished(kind, rng, points)
