# SPDX-License-Identifier: Apache-2.0
"""Sessions whose samples are some vertices of a scene's display mesh."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress
from deltalux.session import Session


@dataclass(frozen=True, eq=False)
class VertexSessions:
    """Makes sessions of one scene.

    Attributes
    ----------
    scene : Scene
    vertices : all vertices, those on movables attached to them
    threads : None = all
    """

    scene: Scene
    vertices: Samples
    threads: int | None

    def bake(
        self,
        rows: np.ndarray,
        *,
        paths: int,
        seed: int,
        direct: str,
        radius: float | None = None,
        progress: Progress | None = None,
    ) -> Session:
        """Make and bake a session with these vertices as samples.

        Parameters
        ----------
        rows : indices of vertices
        paths, seed, direct : see `Session`
        radius : radius of all discs, metres; None = chosen by the session
        """
        all_of = self.vertices
        samples = Samples(all_of.points[rows], all_of.normals[rows], radius, all_of.attached[rows])
        session = Session(
            self.scene,
            samples,
            paths=paths,
            seed=seed,
            threads=self.threads,
            direct=direct,
            gather="off",
            progress=progress,
        )
        session.bake()
        return session
