# SPDX-License-Identifier: Apache-2.0
"""Converts glTF materials to diffuse reflectance and emission."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deltalux.scene import Material
from deltalux.scene.look import ALPHA_MODES, PLAIN, Look, Texture
from deltalux.texels import linear_to_srgb

from .diagnostics import GLASS_REMEDY, LEAST_PASSED, LEFT_OUT, OPAQUE, Notes, UniqueNames, malformed
from .gltf_document import Document
from .gltf_textures import TRANSFORM, Textures

WHITE = 0.98  # largest reflectance: only mirrors reflect more, and paths between such walls are very long


TRANSMISSION = "KHR_materials_transmission"
GLOSSY = "KHR_materials_pbrSpecularGlossiness"


@dataclass(frozen=True)
class _Read:
    """One material of the file, before its light groups are known."""

    name: str
    reflectance: np.ndarray
    emission: np.ndarray
    group: str | None
    two_sided: bool
    look: Look = PLAIN


class Materials:
    """Makes a Material when a triangle first uses it; -1 is glTF's default material.

    Reflectance is baseColorFactor (diffuseFactor of KHR_materials_pbrSpecularGlossiness) times the mean
    linear texel, and times the vertex colour of `tinted` ones; emission is emissiveFactor times
    KHR_materials_emissive_strength times the mean texel.
    """

    def __init__(self, document: Document, textures: Textures, clear_glass: bool) -> None:
        self._clear_glass = clear_glass
        self._document = document
        self._textures = textures
        self._tints: list[tuple[int, np.ndarray]] = []  # of numbers beyond the file's materials
        self._tinted: dict[tuple[int, bytes], int] = {}
        self.begin()

    def begin(self) -> None:
        """Discard the materials made so far; later ones may have other groups."""
        self._names = UniqueNames()
        self._found: dict[int, _Read] = {}
        self._made: dict[tuple[int, str | None], Material] = {}

    @property
    def used(self) -> list[Material]:
        """Every material made so far."""
        return list(self._made.values())

    def material(self, index: int, node_group: str | None, default_group: str | None) -> Material:
        """The material, in the light group of its luminous triangles.

        The node's extras.group takes precedence over the material's, and that over `default_group`.
        """
        found = self._found_at(index)
        group = (node_group or found.group or default_group) if found.emission.any() else None
        key = (index, group)
        if key not in self._made:
            # A material in several groups becomes several materials; the first one keeps the name.
            first = all(made != index for made, _ in self._made)
            name = found.name if first else self._names.take(f"{found.name} [{group or 'own'}]")
            self._made[key] = Material(
                name, found.reflectance, found.emission, group, found.two_sided, found.look
            )
        return self._made[key]

    def tinted(self, index: int, colours: np.ndarray) -> np.ndarray:
        """Numbers (k,) for `material` of a material whose reflectance is multiplied by `colours` (k, 3)."""
        numbers = [index if (colour == 1).all() else self._number(index, colour) for colour in colours]
        return np.array(numbers, np.int64)

    def _number(self, index: int, colour: np.ndarray) -> int:
        key = (index, colour.tobytes())
        if key not in self._tinted:
            self._tinted[key] = len(self._document.gltf.materials) + len(self._tints)
            self._tints.append((index, colour))
        return self._tinted[key]

    def coordinate_set(self, index: int) -> int | None:
        """Number of the texture coordinate set that a material's textures use; None without textures.

        Outputs use one set: that of the reflectance's texture, else of the emission's.
        """
        source = self._document.gltf.materials[index]
        colour, _ = _base_colour(source)
        return _set_of(colour or (source.emissiveTexture if any(source.emissiveFactor) else None))

    def leaves_out(self, index: int) -> bool:
        """Whether triangles of that material are none; tells of it."""
        source = self._document.gltf.materials[index]
        found = self._clear_glass and _is_glass(source)
        if found:
            self._document.notes.add(LEFT_OUT, source.name or f"material{index}")
        return found

    def _found_at(self, index: int) -> _Read:
        if index not in self._found:
            beyond = index - len(self._document.gltf.materials)
            if beyond >= 0:
                self._found[index] = self._with_tint(*self._tints[beyond])
            else:
                self._found[index] = self._read(index) if index >= 0 else self._default()
        return self._found[index]

    def _with_tint(self, index: int, colour: np.ndarray) -> _Read:
        found = self._found_at(index)
        code = "".join(f"{round(255 * c):02x}" for c in linear_to_srgb(colour))
        name = self._names.take(f"{found.name} #{code}")
        return replace(found, name=name, reflectance=found.reflectance * colour)

    def _default(self) -> _Read:
        self._document.notes.add("triangles without a material: glTF's default is white, reflectance 1")
        return _Read(self._names.take("default"), np.ones(3), np.zeros(3), None, False)

    def _read(self, index: int) -> _Read:
        source, place = self._document.gltf.materials[index], f"materials[{index}]"
        name = self._names.take(source.name or f"material{index}")
        _note_unhonoured(source, name, self._document.notes)
        texture, factor = _base_colour(source)
        if GLOSSY in source.extensions:
            self._document.notes.add(f"{GLOSSY}: only the diffuse part is honoured", name)
            texture_place = f"{place}.extensions.{GLOSSY}.diffuseTexture"
        else:
            texture_place = f"{place}.baseColorTexture"
        colour, glow = self._texture(texture, texture_place, name), None
        reflectance = np.clip(np.array(factor[:3]) * _mean(colour), 0.0, 1.0)
        strength = source.extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        emission = np.array(source.emissiveFactor) * strength
        if (emission < 0).any():
            raise malformed(f"{place}: emission", emission.tolist(), "no negative channel")
        if emission.any():
            glow = self._texture(source.emissiveTexture, f"{place}.emissiveTexture", name)
            emission = emission * _mean(glow)
        if reflectance.max() > WHITE:
            self._document.notes.add(
                f"materials reflect more than {WHITE:.0%}, as no real surface does", name
            )
        if _set_of(source.emissiveTexture) != self.coordinate_set(index):
            glow = None
        mode = source.alphaMode if source.alphaMode in ALPHA_MODES else PLAIN.alpha_mode
        cutoff = PLAIN.alpha_cutoff if source.alphaCutoff is None else max(source.alphaCutoff, 0.0)
        look = Look(colour, glow, mode, float(np.clip(factor[3], 0, 1)), cutoff)
        return _Read(name, reflectance, emission, source.extras.get("group"), bool(source.doubleSided), look)

    def _texture(self, reference: Any, place: str, name: str) -> Texture | None:
        if reference is None:
            return None
        self._document.notes.add("textures count with their mean colour", name)
        return self._textures.texture(reference, place)


def _base_colour(source: Any) -> tuple[Any, list[float]]:
    """Texture record (or None) and factor of the diffuse part."""
    glossy = source.extensions.get(GLOSSY)
    if glossy is not None:
        texture, factor = glossy.get("diffuseTexture"), glossy.get("diffuseFactor")
    else:
        pbr = source.pbrMetallicRoughness
        texture, factor = (pbr.baseColorTexture, pbr.baseColorFactor) if pbr else (None, None)
    return texture, factor or [1.0] * 4


def _set_of(reference: Any) -> int | None:
    """Number of the texture coordinate set in a texture record."""
    if reference is None:
        return None
    return reference.extensions.get(TRANSFORM, {}).get("texCoord", reference.texCoord or 0)


def _mean(texture: Texture | None) -> np.ndarray:
    return np.ones(3) if texture is None else texture.mean


def _is_glass(source: Any) -> bool:
    """Whether a material lets at least half of the light through, and does not glow."""
    _, factor = _base_colour(source)
    passes = source.extensions.get(TRANSMISSION, {}).get("transmissionFactor", 0.0)
    if source.alphaMode == "BLEND":
        passes = max(passes, 1 - factor[3])
    return passes >= LEAST_PASSED and not any(source.emissiveFactor)


def _note_unhonoured(source: Any, name: str, notes: Notes) -> None:
    pbr = source.pbrMetallicRoughness
    if GLOSSY not in source.extensions and (pbr is None or pbr.metallicFactor > 0):
        notes.add("metals count as diffuse", name)
    if source.alphaMode not in (None, "OPAQUE") or TRANSMISSION in source.extensions:
        notes.add(OPAQUE, name)
    if _is_glass(source):
        notes.add(GLASS_REMEDY, name)
    if source.normalTexture is not None:
        notes.add("normal maps are not honoured", name)
    if source.occlusionTexture is not None:
        notes.add("occlusion maps are not honoured", name)
