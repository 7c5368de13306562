# SPDX-License-Identifier: Apache-2.0
"""Textures, transparency and texture coordinates as entries of a session file's index and arrays."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from deltalux.errors import FormatError
from deltalux.scene import Material, Mesh, Scene
from deltalux.scene.core_textures import CoreTextures
from deltalux.scene.look import MOST, WRAPS, Look, Texture, images_of

from .archive import ArchiveReader, ArchiveWriter
from .fields import Fields

FIELDS = ("images", "textures", "materials", "meshes")
_SAMPLER = ("wrap", "mag_filter", "min_filter", "offset", "rotation", "scale")
_TEXTURE = ("image", "mean", *_SAMPLER, "by_alpha")
_LOOK = ("colour", "glow", "alpha_mode", "alpha", "alpha_cutoff", "texels")
_MOST_IMAGE = 2**40  # bytes; an array cannot exceed the file anyway
_MOST_FILTER = 2**16  # bound of filter numbers; Texture knows the valid ones
_IMAGES, _COORDINATES = "images", "meshes/coordinates"


def pack_looks(scene: Scene) -> dict[str, Any] | None:
    """The index entry; `write_looks` writes the arrays. None if no material and no mesh has any looks."""
    textures = _textures(scene)
    images = images_of(textures)
    decoded = CoreTextures(scene.materials)
    numbers = {id(texture): i for i, texture in enumerate(textures)}
    places = {id(image): i for i, image in enumerate(images)}
    plain = all(_is_plain(m.look) for m in scene.materials)
    if plain and all(mesh.coordinates is None for mesh in scene.meshes):
        return None
    return {
        "images": [len(image) for image in images],
        "textures": [
            {
                "image": places[id(t.image)],
                "mean": t.mean.tolist(),
                "wrap": list(t.wrap),
                "mag_filter": t.mag_filter,
                "min_filter": t.min_filter,
                "offset": [float(x) for x in t.offset],
                "rotation": float(t.rotation),
                "scale": [float(x) for x in t.scale],
                "by_alpha": bool(t.by_alpha),
            }
            for t in textures
        ],
        "materials": [
            {
                "colour": numbers.get(id(m.look.colour), -1),
                "glow": numbers.get(id(m.look.glow), -1),
                "alpha_mode": m.look.alpha_mode,
                "alpha": float(m.look.alpha),
                "alpha_cutoff": float(m.look.alpha_cutoff),
                "texels": decoded.hash_of(m),
            }
            for m in scene.materials
        ],
        "meshes": [i for i, mesh in enumerate(scene.meshes) if mesh.coordinates is not None],
    }


def write_looks(scene: Scene, archive: ArchiveWriter) -> None:
    """Write each encoded image once, and the texture coordinates of the meshes that have them."""
    images = images_of(_textures(scene))
    if images:
        archive.add_bytes(_IMAGES, "|u1", (sum(map(len, images)),), images)
    coordinates = [m.coordinates.reshape(-1, 6) for m in scene.meshes if m.coordinates is not None]
    if coordinates:
        archive.add_array(_COORDINATES, "<f4", coordinates, 6)


def unpack_looks(
    data: Fields, meshes: Sequence[Mesh], materials: Sequence[Material], archive: ArchiveReader
) -> tuple[list[Mesh], list[Material]]:
    """Meshes and materials with the looks that an index entry and the arrays contain.

    Raises
    ------
    FormatError, SceneError
    """
    images = [
        archive.rows(_IMAGES, "|u1", size).tobytes() for size in data.integers("images", 0, _MOST_IMAGE)
    ]
    textures = [_unpack_texture(entry, images) for entry in data.objects("textures", _TEXTURE)]
    looks = [_unpack_look(entry, textures) for entry in data.objects("materials", _LOOK)]
    if len(looks) != len(materials):
        raise FormatError(f"index.scene.looks.materials: found {len(looks)}, expected {len(materials)}")
    result = list(meshes)
    for index in data.integers("meshes", 0, len(meshes) - 1):
        rows = archive.rows(_COORDINATES, "<f4", len(meshes[index].triangles), 6)
        result[index] = replace(meshes[index], coordinates=rows.reshape(-1, 3, 2))
    return result, [replace(m, look=look) for m, look in zip(materials, looks, strict=True)]


def _textures(scene: Scene) -> list[Texture]:
    """Every texture once, in order of the materials."""
    found = {id(texture): texture for m in scene.materials for texture in m.look.textures}
    return list(found.values())


def _is_plain(look: Look) -> bool:
    return look.colour is None and look.glow is None and look.alpha_mode == "OPAQUE"


def _unpack_texture(entry: Fields, images: Sequence[bytes]) -> Texture:
    offset, scale = (entry.numbers(name, 2, least=-MOST, most=MOST).tolist() for name in ("offset", "scale"))
    wrap = entry.integers("wrap", WRAPS[0], WRAPS[-1], 2)
    return Texture(
        images[entry.integer("image", 0, len(images) - 1)],
        entry.numbers("mean", 3, least=0, most=1),
        (wrap[0], wrap[1]),
        _optional(entry, "mag_filter"),
        _optional(entry, "min_filter"),
        (offset[0], offset[1]),
        entry.number("rotation", -MOST, MOST),
        (scale[0], scale[1]),
        entry.boolean("by_alpha"),
    )


def _optional(entry: Fields, name: str) -> int | None:
    return None if entry.any(name) is None else entry.integer(name, 0, _MOST_FILTER)


def _unpack_look(entry: Fields, textures: Sequence[Texture]) -> Look:
    numbers = [entry.integer(name, -1, len(textures) - 1) for name in ("colour", "glow")]
    colour, glow = (None if number < 0 else textures[number] for number in numbers)
    return Look(
        colour,
        glow,
        entry.text("alpha_mode"),
        entry.number("alpha", 0, 1),
        entry.number("alpha_cutoff", 0, MOST),
        entry.optional_text("texels"),
    )
