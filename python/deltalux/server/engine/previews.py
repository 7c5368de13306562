# SPDX-License-Identifier: Apache-2.0
"""Previews during the first bake: temporary sessions with few paths and unclipped discs."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from deltalux.pace import Step, baking, counts_with
from deltalux.server.edits import EditState, differences, queue_edit
from deltalux.session import Session

from .progress import TaskProgress

COARSER = (100, 10)  # divisors of the number of paths
# factor on the paths for sessions that gather: their number of paths is chosen for rays, and discs need more
OF_RAYS = 5
FEWEST = 1000  # paths; with fewer a preview shows nothing useful


def _coarse_options(session: Session) -> list[dict[str, Any]]:
    """The options of each preview.

    By default, discs are clipped to what is visible from their centres, which takes half of a bake; a
    preview uses whole discs.
    """
    options = session.options
    most = options["paths"] * (1 if options["gather"] == "off" else OF_RAYS)
    coarse = options | {"disc_area": "whole", "gather": "off"}
    return [coarse | {"paths": most // by} for by in COARSER if most // by >= FEWEST]


def preview_steps(session: Session) -> list[Step]:
    """Steps of all previews; whole discs need no openness."""
    return [
        step
        for options in _coarse_options(session)
        for step in baking(counts_with(session.scene, session.samples, options))
        if step.name != "openness"
    ]


def previews(session: Session, wanted: EditState, progress: TaskProgress) -> Iterator[Session]:
    """Bake coarse sessions in the wanted state; each is closed when the next one is requested."""
    for options in _coarse_options(session):
        with Session(session.scene, session.samples, progress=progress, **options) as few:
            for key, value in differences(few, wanted).items():
                queue_edit(few, key, value)
            few.bake()
            yield few
