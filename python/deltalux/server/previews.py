# SPDX-License-Identifier: Apache-2.0
"""Previews during the first bake: temporary sessions with few paths and unclipped discs."""

from __future__ import annotations

from collections.abc import Iterator

from deltalux.session import Session

from .edits import EditState, differences, queue_edit
from .progress import TaskProgress, shares_of

# divisor of the number of paths, and share of the whole time at the preview's end
COARSER = ((100, 0.035), (10, 0.09))
# factor on the paths for sessions that gather: their number of paths is chosen for rays, and discs need more
OF_RAYS = 5
FEWEST = 1000  # paths; with fewer a preview shows nothing useful


def previews(session: Session, wanted: EditState, progress: TaskProgress) -> Iterator[Session]:
    """Bake coarse sessions in the wanted state; each is closed when the next one is requested.

    By default, discs are clipped to what is visible from their centres, which takes half of a bake; a
    preview uses whole discs.

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
