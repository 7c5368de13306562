# SPDX-License-Identifier: Apache-2.0
"""Values in the form that pages receive: half floats with a common scale."""

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

from .drawn_mesh import DrawnMesh

BRIGHTEST = 2.0**12  # what the largest value becomes: room for 16 times as much in float16,
LEAST, MOST = 2.0**6, 65504.0  # and what it may become before a new scale is worth a frame of all values


@dataclass(frozen=True, eq=False)
class Values:
    """One state of the light, encoded.

    Parameters
    ----------
    rows : (n,) uint64, one for each vertex; it holds R, G, B and the photopic standard error as float16
    scale : power of two by which all values are multiplied
    revision : revision of the wanted state that they belong to
    preview : whether they come from a coarse bake
    rest : whether the light of the revision is complete, and nothing is being dragged
    """

    rows: np.ndarray
    scale: float
    revision: int
    preview: bool
    rest: bool = False


@dataclass(frozen=True, eq=False)
class VertexFill:
    """Computes values at the vertices that pages draw from samples, and fills them in at rims.

    `drawn` : None: pages draw the display mesh itself
    `beyond` : (d, 3) or None, the value of `Session.direct_beyond_samples`
    """

    display: DisplayMesh
    fill: RimFill
    drawn: DrawnMesh | None = None
    beyond: np.ndarray | None = None

    def __call__(self, values: np.ndarray) -> np.ndarray:
        """Values (n, c) at the vertices, a copy, from values (s, c) of the samples."""
        values = add_detail(self.display.at_vertices(values).copy(), self.display, self.beyond)
        return self.fill(values) if self.drawn is None else self.drawn.at(self.fill(values))


def fill_of(session: Session, drawn: DrawnMesh | None = None) -> VertexFill:
    """How vertices show the light of samples; the rims of covered samples do not depend on movables' poses.

    Samples count as covered by static surfaces if they are static, and by their own movable otherwise.
    Pictures determine this for each pose, which takes a second on large scenes.
    """
    display = session.samples.display
    assert display is not None
    poses = movables_apart(session.scene)
    surfaces = Surfaces(session.scene, display, poses, session.options["threads"] or 0)
    return VertexFill(display, rim_fill(covered_samples(surfaces), display.triangles), drawn)


class Encoder:
    """Encodes irradiance and standard errors of samples as `Values`; keeps the scale while it fits."""

    def __init__(self, fill: Callable[[np.ndarray], np.ndarray]) -> None:
        self._fill = fill
        self._scale = 1.0

    def use(self, fill: Callable[[np.ndarray], np.ndarray]) -> None:
        """Use this fill from now on."""
        self._fill = fill

    def encode(self, values: np.ndarray, revision: int, *, preview: bool, rest: bool) -> Values:
        """Encode the (s, 4) values of `Session.read_packed`."""
        values = self._fill(values)
        self._choose_scale(float(values.max(initial=0.0)))
        values *= np.float32(self._scale)  # in place: they are a copy
        rows = values.astype("<f2").view("<u8").ravel()
        rows.setflags(write=False)
        return Values(rows, self._scale, revision, preview, rest)

    def _choose_scale(self, largest: float) -> None:
        if largest > 0 and not LEAST <= largest * self._scale <= MOST:
            self._scale = 2.0 ** np.floor(np.log2(BRIGHTEST / largest))
