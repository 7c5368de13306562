# SPDX-License-Identifier: Apache-2.0
"""Samples: points, normals and disc radii where irradiance is estimated."""

from __future__ import annotations

from collections.abc import Sequence
from copy import copy
from typing import Any

import numpy as np

from deltalux.errors import OptionError
from deltalux.mesh.display_mesh import BOTH, DisplayMesh, refine
from deltalux.mesh.shadow_detail import with_detail
from deltalux.scene import Scene
from deltalux.units import FARTHEST
from deltalux.vectors import unit

from .clearance import Clearance
from .lit_sides import lit_sides
from .shared_samples import shared

SIDES = ("auto", "front", "both")
MAX_GRID_POINTS = 50_000_000


def _points(values: Any, what: str, count: int | None = None) -> np.ndarray:
    try:
        array = np.array(values, dtype=np.float64)
    except (TypeError, ValueError) as error:
        raise OptionError(f"samples: {what}: expected numbers ({error})") from None
    if array.ndim == 1 and array.size == 3:
        array = array.reshape(1, 3)
    if array.ndim != 2 or array.shape[1] != 3:
        raise OptionError(f"samples: {what}: found shape {array.shape}, expected (n, 3)")
    if count is not None and len(array) != count:
        raise OptionError(f"samples: {what}: found {len(array)} rows, expected {count}, one for each point")
    bad = np.flatnonzero(~np.isfinite(array).all(axis=1))
    if len(bad):
        raise OptionError(f"samples: {what}: found {array[bad[0]]} at row {bad[0]}, expected finite numbers")
    return array


class Samples:
    """Points and normals where irradiance is estimated.

    Parameters
    ----------
    points : (n, 3) array, metres; world, or local to the movable that they are attached to
    normals : (n, 3) array; scaled to unit length
    radius : number, (n,) array, or None
        Disc radius in metres; None chooses one per sample that balances noise and blur.
    attached_to : str, sequence of str or None (one for each sample), or None
        Name of the movable that a sample moves with.

    Raises
    ------
    OptionError
        For malformed arrays, a point beyond 1e15 m, a zero normal, or a radius that is not positive.
    """

    def __init__(self, points: Any, normals: Any, radius: Any = None, attached_to: Any = None) -> None:
        self.points = _points(points, "points")
        if (farthest := np.abs(self.points).max(initial=0)) > FARTHEST:
            raise OptionError(
                f"samples: points: found a coordinate of {farthest:g} m, expected at most {FARTHEST:g}"
            )
        count = len(self.points)
        normals = _points(normals, "normals")
        if len(normals) == 1 and count != 1:
            normals = np.repeat(normals, count, axis=0)
        self.normals = _points(normals, "normals", count)
        zero = ~self.normals.any(axis=1)
        if zero.any():
            raise OptionError(f"samples: normals: found zero at row {np.argmax(zero)}, expected a direction")
        self.normals = unit(self.normals)
        self.radius = _radius(radius, count)
        self.attached = _attached(attached_to, count)
        self.display: DisplayMesh | None = None
        self.grid_shape: tuple[int, int] | None = None
        # cell of each sample, row by row; None: every cell has a sample
        self.grid_cells: np.ndarray | None = None
        self.spacing: float | None = None
        for array in (self.points, self.normals, self.radius, self.attached):
            array.setflags(write=False)

    def __len__(self) -> int:
        return len(self.points)

    @property
    def areas(self) -> np.ndarray:
        """(n,) square metres that each sample represents: a third of the display triangles around it.

        Samples without a display mesh all represent the same area: a grid's cell, or one square metre.
        """
        if self.display is not None:
            return self.display.sample_areas()
        return np.full(len(self), self.spacing**2 if self.grid_shape and self.spacing else 1.0)

    @classmethod
    def on_vertices(
        cls,
        scene: Scene,
        spacing: float | None = None,
        radius: Any = None,
        display: DisplayMesh | None = None,
        sides: str = "auto",
        share: bool = True,
        detail: float | str | None = None,
    ) -> Samples:
        """Samples on the vertices of the scene's display mesh, refined to `spacing` without cracks.

        If there are more than 60,000 vertices, those of one smooth surface that lie much closer together than
        `spacing` share samples: `display.at_vertices` computes the value of each vertex.

        Parameters
        ----------
        spacing : metres; None chooses from the scene's area
        radius : as in the constructor, or "spacing": half the spacing (paper 2.1)
        display : use this display mesh; `spacing`, `sides`, `share` and `detail` are ignored then
        sides : "auto", "front" or "both"
            Which sides of the triangles get samples. "auto": the sides that light reaches, found by a pilot
            of static light paths with a seed of its own. These are both sides of a sheet that is lit from
            both, and the back sides of a room whose triangles wind outward; without static lights, the front.
            Movables get samples on the sides that are visible from outside.
        share : False gives each vertex a sample of its own
        detail : metres, "auto" or None
            Refine the display mesh at the edges of shadows and of spots' pools of light, down to this length
            ("auto": a quarter of the spacing), to at most twice the vertices. Added vertices have no samples:
            `display.detail` lists them, and `Session.vertex_irradiance` computes their light.

        Raises
        ------
        OptionError
            For an unknown name, or a spacing that is not positive or needs too many samples.
        """
        mesh = _display(scene, spacing, sides, share, detail) if display is None else display
        names = np.array([*(m.name for m in scene.meshes), None], dtype=object)
        if isinstance(radius, str):
            if radius != "spacing":
                raise OptionError(f'samples: radius: found "{radius}", expected metres, None or "spacing"')
            radius = 0.5 * mesh.spacing
        own = mesh.sample_vertices
        samples = cls(mesh.sample_points[own], mesh.normals[own], radius, names[mesh.attached[own]])
        samples.display = mesh
        samples.spacing = mesh.spacing
        return samples

    @classmethod
    def on_grid(cls, origin: Any, u: Any, v: Any, spacing: float, radius: Any = None) -> Samples:
        """Samples on a working plane: points every `spacing` from origin along u and v, normal u × v.

        The points are the centres of cells that fill the rectangle spanned by u and v, row by row along u;
        `grid_shape` is (rows along v, columns along u).
        """
        origin, u, v = (_points(x, name)[0] for x, name in ((origin, "origin"), (u, "u"), (v, "v")))
        if not (np.isfinite(spacing) and spacing > 0):
            raise OptionError(f"grid: spacing: found {spacing}, expected positive metres")
        farthest = max(float(np.abs(side).max()) for side in (origin, u, v))
        if farthest > FARTHEST:
            raise OptionError(f"grid: found {farthest:g} metres, expected at most {FARTHEST:g}")
        normal = np.cross(unit(u), unit(v))
        if not normal.any():
            raise OptionError("grid: u and v are parallel or zero, expected two sides of a rectangle")
        along = [max(1.0, float(np.linalg.norm(side)) / float(spacing) + 1e-6) for side in (u, v)]
        if along[0] * along[1] > MAX_GRID_POINTS:
            raise OptionError(
                f"grid: found {along[0]:.3g} × {along[1]:.3g} points, expected at most {MAX_GRID_POINTS:,}; "
                "give a larger spacing"
            )
        counts = [int(count) for count in along]
        a = (np.arange(counts[0]) + 0.5) / counts[0]
        b = (np.arange(counts[1]) + 0.5) / counts[1]
        points = origin + (b[:, None, None] * v + a[None, :, None] * u)
        samples = cls(points.reshape(-1, 3), normal, radius)
        samples.grid_shape = (counts[1], counts[0])
        samples.spacing = float(spacing)
        return samples

    def shown_on(self, display: DisplayMesh) -> Samples:
        """The same samples with another display mesh, whose vertices are interpolated from these samples."""
        other = copy(self)
        other.display = display
        return other

    def without(self, left_out: np.ndarray) -> Samples:
        """The samples that `left_out` (n,) bool does not mark; a grid gets holes. Not for display meshes."""
        if self.display is not None:
            raise OptionError("samples: found ones on a display mesh, expected a grid or samples from arrays")
        kept = np.flatnonzero(~np.asarray(left_out, bool))
        samples = Samples(self.points[kept], self.normals[kept], self.radius[kept], self.attached[kept])
        samples.grid_shape, samples.spacing = self.grid_shape, self.spacing
        if self.grid_shape is not None and len(kept) < len(self):
            samples.grid_cells = kept if self.grid_cells is None else self.grid_cells[kept]
        return samples

    def in_grid(self, values: np.ndarray) -> np.ndarray:
        """(rows, columns) of the samples' values (n,), NaN in the grid's holes.

        Raises
        ------
        OptionError
            If the samples do not form a grid.
        """
        if self.grid_shape is None:
            raise OptionError("samples: found ones that are no grid, expected those of Samples.on_grid")
        grid = np.full(self.grid_shape[0] * self.grid_shape[1], np.nan)
        grid[slice(None) if self.grid_cells is None else self.grid_cells] = values
        return grid.reshape(self.grid_shape)

    @classmethod
    def concatenate(cls, parts: Sequence[Samples]) -> Samples:
        """All samples of `parts`, in order."""
        if not parts:
            raise OptionError("samples: found nothing to concatenate, expected at least one set")
        return cls(
            np.concatenate([p.points for p in parts]),
            np.concatenate([p.normals for p in parts]),
            np.concatenate([p.radius for p in parts]),
            np.concatenate([p.attached for p in parts]),
        )

    def __repr__(self) -> str:
        moving = int(sum(name is not None for name in self.attached))
        return f"Samples({len(self)}, {moving} of them on movables)"


def _display(
    scene: Scene, spacing: float | None, sides: str, share: bool, detail: float | str | None
) -> DisplayMesh:
    if detail is not None and not share:
        raise OptionError("samples: found detail with share=False, expected share=True: what it adds shares")
    if sides not in SIDES:
        raise OptionError(f"samples: sides: found {sides!r}, expected one of {SIDES}")
    chosen = None
    if sides == "auto":
        chosen = lit_sides(scene)
    elif sides == "both":
        chosen = np.full(sum(len(m.triangles) for m in scene.meshes), BOTH)
    mesh = refine(scene, spacing, sides=chosen)
    clearance = Clearance(scene, mesh)
    cleared = clearance.cleared(shared(mesh, clearance.covered) if share else mesh)
    return with_detail(scene, cleared, detail)


def _radius(radius: Any, count: int) -> np.ndarray:
    """(n,) float64; NaN: chosen automatically."""
    if radius is None:
        return np.full(count, np.nan)
    values = np.array(radius, dtype=np.float64)
    if values.ndim == 0:
        values = np.full(count, values)
    if values.shape != (count,):
        raise OptionError(f"samples: radius: found shape {values.shape}, expected a number or ({count},)")
    given = values[~np.isnan(values)] if np.ndim(radius) else values
    wrong = given[~((given > 0) & (given <= FARTHEST))]
    if len(wrong):
        raise OptionError(f"samples: radius: found {wrong[0]:g}, expected positive metres up to {FARTHEST:g}")
    # A file may hold a signalling NaN, which raises a warning when it is converted.
    values[np.isnan(values)] = np.nan
    return values


def _attached(attached_to: Any, count: int) -> np.ndarray:
    """(n,) object array of names or None."""
    names = np.full(count, None, dtype=object)
    if attached_to is None or isinstance(attached_to, str):
        names[:] = attached_to
    elif len(attached_to) == count:
        names[:] = list(attached_to)
    else:
        raise OptionError(f"samples: attached_to: found {len(attached_to)} names, expected {count}")
    return names
