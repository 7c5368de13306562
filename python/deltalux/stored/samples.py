# SPDX-License-Identifier: Apache-2.0
"""Samples and their display mesh as entries of a session file's index and arrays."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from deltalux.errors import FormatError
from deltalux.mesh.display_mesh import DisplayMesh, Refinement
from deltalux.mesh.sharing import NEIGHBOURS, Sharing
from deltalux.samples.samples import MAX_GRID_POINTS, Samples
from deltalux.scene import Scene
from deltalux.units import FARTHEST

from .archive import ArchiveReader, ArchiveWriter
from .fields import Fields

FIELDS = ("attached", "grid_shape", "grid_holes", "spacing", "display_spacing", "sharing", "detail")
# Arrays of the display mesh: dtype and columns.
_VERTICES = {
    "points": ("<f8", 3),
    "sample_points": ("<f8", 3),
    "normals": ("<f8", 3),
    "vertex_mesh": ("<i4", 0),
    "attached": ("<i4", 0),
}
LONGEST_NORMAL = 1.001  # bound of each component, with rounding
WEIGHT_TOLERANCE = 1e-5  # tolerance of the sum of a row of weights in single precision, which must be 1
_TRIANGLES = {
    "triangles": ("<i8", 3),
    "triangle_material": ("<i4", 0),
    "triangle_mesh": ("<i4", 0),
    "source_triangle": ("<i8", 0),
    "reversed": ("|b1", 0),
}


def pack_samples(samples: Samples) -> dict[str, Any]:
    """The index entry; `write_samples` writes the arrays."""
    return {
        "attached": _names(samples),
        "grid_shape": None if samples.grid_shape is None else [int(n) for n in samples.grid_shape],
        "grid_holes": samples.grid_cells is not None,
        "spacing": None if samples.spacing is None else float(samples.spacing),
        "display_spacing": None if samples.display is None else float(samples.display.spacing),
        "sharing": samples.display is not None and samples.display.sharing is not None,
        "detail": None if samples.display is None else samples.display.detail_length,
    }


def _names(samples: Samples) -> list[str]:
    return sorted({name for name in samples.attached if name is not None})


def write_samples(samples: Samples, archive: ArchiveWriter) -> None:
    """Write points, normals, radii, attachments and the display mesh."""
    number = {name: i for i, name in enumerate(_names(samples))}
    attached = np.array([number.get(name, -1) for name in samples.attached], np.int32)
    archive.add_array("samples/points", "<f8", [samples.points], 3)
    archive.add_array("samples/normals", "<f8", [samples.normals], 3)
    archive.add_array("samples/radius", "<f8", [samples.radius])
    archive.add_array("samples/attached", "<i4", [attached])
    if samples.grid_cells is not None:
        archive.add_array("samples/grid_cells", "<i8", [samples.grid_cells])
    if samples.display is not None:
        for name, (dtype, columns) in (_VERTICES | _TRIANGLES).items():
            archive.add_array(f"display/{name}", dtype, [getattr(samples.display, name)], columns)
        if (sharing := samples.display.sharing) is not None:
            archive.add_array("sharing/vertices", "<i8", [sharing.vertices])
            archive.add_array("sharing/samples", "<i4", [sharing.samples], NEIGHBOURS)
            archive.add_array("sharing/weights", "<f4", [sharing.weights], NEIGHBOURS)
        if (refinement := samples.display.refinement) is not None:
            archive.add_array("display/detail", "<i8", [refinement.vertices])
            archive.add_array("display/plain_triangles", "<i8", [refinement.plain_triangles], 3)
            archive.add_array("display/plain_triangle", "<i8", [refinement.plain_triangle])


def unpack_samples(data: Fields, scene: Scene, archive: ArchiveReader) -> Samples:
    """Restore the samples from an index entry and the arrays.

    Raises
    ------
    FormatError, OptionError
    """
    names = np.array([*data.texts("attached"), None], dtype=object)
    points = archive.array("samples/points", "<f8", columns=3)
    count = len(points)
    attached = archive.array("samples/attached", "<i4", count)
    _check_range("samples/attached", attached, -1, len(names) - 2)
    samples = Samples(
        points,
        archive.array("samples/normals", "<f8", count, 3),
        archive.array("samples/radius", "<f8", count),
        names[attached],
    )
    if data.any("grid_shape") is not None:
        rows, columns = data.integers("grid_shape", 1, MAX_GRID_POINTS, 2)
        cells = rows * columns
        holes = data.boolean("grid_holes")
        if not (count <= cells <= MAX_GRID_POINTS if holes else cells == count):
            raise FormatError(f"index.samples.grid_shape: found {rows} by {columns} for {count} samples")
        samples.grid_shape = (rows, columns)
        if holes:
            samples.grid_cells = archive.array("samples/grid_cells", "<i8", count)
            _check_range("samples/grid_cells", samples.grid_cells, 0, cells - 1)
            if (np.diff(samples.grid_cells) <= 0).any():
                raise FormatError('"samples/grid_cells": found cells that do not rise, expected rising ones')
    if data.any("spacing") is not None:
        samples.spacing = data.number("spacing", np.finfo(float).tiny)
    if data.any("display_spacing") is not None:
        spacing = data.number("display_spacing", np.finfo(float).tiny)
        sharing = _read_sharing(count, archive) if data.boolean("sharing") else None
        vertices = count if sharing is None else len(sharing.samples)
        if sharing is not None:
            _check_range("sharing/vertices", sharing.vertices, 0, vertices - 1)
        samples.display = _read_display(scene, vertices, spacing, archive, sharing)
        if data.any("detail") is not None:
            length = data.number("detail", np.finfo(float).tiny)
            refinement = _read_refinement(samples.display, length, archive)
            samples.display = replace(samples.display, refinement=refinement)
    return samples


def _read_refinement(display: DisplayMesh, length: float, archive: ArchiveReader) -> Refinement:
    detail = archive.array("display/detail", "<i8")
    _check_range("display/detail", detail, 0, len(display.points) - 1)
    plain = archive.array("display/plain_triangles", "<i8", columns=3)
    part = archive.array("display/plain_triangle", "<i8", len(display.triangles))
    is_plain = np.ones(len(display.points), dtype=bool)
    is_plain[detail] = False
    _check_range("display/plain_triangles", plain, 0, len(display.points) - 1)
    _check_range("display/plain_triangle", part, 0, len(plain) - 1)
    whole = np.bincount(part, minlength=len(plain)).all() and is_plain[plain].all()
    if not whole or not is_plain[display.sample_vertices].all():
        raise FormatError('"display/detail": found vertices without which there is no mesh')
    return Refinement(detail, length, plain, part)


def _read_sharing(count: int, archive: ArchiveReader) -> Sharing:
    """Sharing of `count` samples; does not check `vertices`, whose number is not known yet."""
    vertices = archive.array("sharing/vertices", "<i8", count)
    samples = archive.array("sharing/samples", "<i4", columns=NEIGHBOURS)
    weights = archive.array("sharing/weights", "<f4", len(samples), NEIGHBOURS)
    _check_range("sharing/samples", samples, 0, count - 1)
    off = np.abs(weights.sum(axis=1, dtype=np.float64) - 1) > WEIGHT_TOLERANCE
    if off.any() or not ((weights >= 0) & (weights <= 1)).all():
        raise FormatError('"sharing/weights": found a row that does not add up to 1')
    return Sharing(vertices, samples, weights)


def _read_display(
    scene: Scene, count: int, spacing: float, archive: ArchiveReader, sharing: Sharing | None
) -> DisplayMesh:
    arrays: dict[str, Any] = {
        name: archive.array(f"display/{name}", dtype, count, columns)
        for name, (dtype, columns) in _VERTICES.items()
    }
    triangles = archive.array("display/triangles", "<i8", columns=3)
    arrays["triangles"] = triangles
    for name, (dtype, columns) in _TRIANGLES.items():
        if name != "triangles":
            arrays[name] = archive.array(f"display/{name}", dtype, len(triangles), columns)
    for name, most in (("points", FARTHEST), ("sample_points", FARTHEST), ("normals", LONGEST_NORMAL)):
        _check_range(f"display/{name}", arrays[name], -most, most)
    display = DisplayMesh(**arrays, spacing=spacing, sharing=sharing)
    if misfit := display.misfit(scene):
        raise FormatError(misfit)
    return display


def _check_range(name: str, values: np.ndarray, least: float, most: Any) -> None:
    bad = np.flatnonzero(~((values >= least) & (values <= most)))
    if len(bad):
        raise FormatError(f'"{name}": found {values.flat[bad[0]]} at entry {bad[0]}, beyond what there is')
