# SPDX-License-Identifier: Apache-2.0
"""Coarse light while the first bake runs: throw-away sessions with few paths over plain discs."""

from __future__ import annotations

from collections.abc import Iterator

from deltalux.session import Session

from .edits import EditState, differences, queue_edit
from .progress import TaskProgress, shares_of

COARSER = ((100, 0.035), (10, 0.09))  # times fewer paths, and the share of the whole time at its end
OF_RAYS = 5  # times the paths, where each tells the rays what many would tell discs
FEWEST = 1000  # paths; less shows nothing


def previews(session: Session, wanted: EditState, progress: TaskProgress) -> Iterator[Session]:
    """Bake coarse sessions in the wanted state, each closed when the next one is asked for.

    The discs of the default are clipped to what their centres reach, which takes half of a bake; a
    preview counts whole discs.

    Afterwards `progress` is set for the real bake.
    """
    options = session.options
    bake, begun = shares_of("bake", options), 0.0
    coarse = options | {"disc_area": "whole", "gather": "off"}
    for coarser, end in COARSER:
        paths = options["paths"] * (1 if options["gather"] == "off" else OF_RAYS) // coarser
        if paths < FEWEST:
            continue
        progress.part(begun, end, shares_of("bake", coarse))
        with Session(session.scene, session.samples, progress=progress, **coarse | {"paths": paths}) as few:
            for key, value in differences(few, wanted).items():
                queue_edit(few, key, value)
            few.bake()
            yield few
        begun = end
        progress.part(begun, 1.0, bake)
