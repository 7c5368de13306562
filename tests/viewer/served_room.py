# SPDX-License-Identifier: Apache-2.0
"""The session that the viewer's tests serve."""

from __future__ import annotations

from pathlib import Path

import deltalux as dl
from rooms import room

PATHS = 4000


def make_session(paths: int = PATHS, gather: str | int = "off") -> dl.Session:
    """A session of the room, not baked. With discs of given radii its history does not matter."""
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.6, radius=0.15)
    return dl.Session(scene, samples, paths=paths, threads=2, gather=gather)


def saved(session: dl.Session, path: Path) -> Path:
    """The file of a session, baked, which is closed then."""
    with session:
        session.bake()
        session.save(path)
    return path
