# SPDX-License-Identifier: Apache-2.0
"""Values as pages get them: half floats with a common scale."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.mesh.surfaces import Surfaces
from deltalux.mesh.vertex_light import add_detail
from deltalux.outputs.covered import RimFill, rim_fill
from deltalux.samples.clearance import covered_samples, movables_apart
from deltalux.session import Session

BRIGHTEST = 2.0**12  # what the largest value becomes: room for 16 times as much in float16,
LEAST, MOST = 2.0**6, 65504.0  # and what it may become before a new scale is worth a frame of all values


@dataclass(frozen=True, eq=False)
class Values:
    """One state of the light, encoded.

    Parameters
    ----------
    rows : (n,) uint64, one for each vertex; it holds R, G, B and the photopic standard error as float16
    scale : a power of two that all values were multiplied by
    revision : of the wanted state that they belong to
    preview : they come from a coarse bake
    rest : the light of the revision is complete, and nothing is being dragged
    """

    rows: np.ndarray
    scale: float
    revision: int
    preview: bool
    rest: bool = False


@dataclass(frozen=True, eq=False)
class VertexFill:
    """What the vertices of a display mesh show: light of their samples, filled in at rims.

    `beyond` : (d, 3) or None, of `Session.direct_beyond_samples`
    """

    display: DisplayMesh
    fill: RimFill
    beyond: np.ndarray | None = None

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """(n, c) of the vertices, a copy, from (s, c) of the samples."""
        return self.fill(add_detail(self.display.at_vertices(values).copy(), self.display, self.beyond))


def fill_of(session: Session) -> VertexFill:
    """How vertices show the light of samples; those at the rim of covered ones whatever the movables' poses.

    Static samples are judged among static surfaces, those of a movable on the movable alone. Pictures decide
    this anew for each pose, which takes a second on large scenes.
    """
    display = session.samples.display
    assert display is not None
    poses = movables_apart(session.scene)
    surfaces = Surfaces(session.scene, display, poses, session.options["threads"] or 0)
    return VertexFill(display, rim_fill(covered_samples(surfaces), display.triangles))


class Encoder:
    """Turns irradiance and standard errors of samples into `Values`; keeps the scale while it fits."""

    def __init__(self, fill: Callable[[np.ndarray], np.ndarray]) -> None:
        self._fill = fill
        self._scale = 1.0

    def use(self, fill: Callable[[np.ndarray], np.ndarray]) -> None:
        """From now on."""
        self._fill = fill

    def encode(self, values: np.ndarray, revision: int, *, preview: bool, rest: bool) -> Values:
        """Encode the (s, 4) values of `Session.read_packed`."""
        values = self._fill(values)
        self._choose_scale(float(values.max(initial=0.0)))
        values *= np.float32(self._scale)  # they are a copy
        rows = values.astype("<f2").view("<u8").ravel()
        rows.setflags(write=False)
        return Values(rows, self._scale, revision, preview, rest)

    def _choose_scale(self, largest: float) -> None:
        if largest > 0 and not LEAST <= largest * self._scale <= MOST:
            self._scale = 2.0 ** np.floor(np.log2(BRIGHTEST / largest))
