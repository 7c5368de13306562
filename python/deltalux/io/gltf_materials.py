# SPDX-License-Identifier: Apache-2.0
"""glTF materials to diffuse reflectance and emission."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from deltalux.scene import Material

from .diagnostics import Notes, UniqueNames, malformed
from .gltf_document import Document
from .gltf_textures import Textures

WHITE = 0.98  # nothing but a mirror reflects more; paths between such walls end late


@dataclass(frozen=True)
class _Look:
    name: str
    reflectance: np.ndarray
    emission: np.ndarray
    group: str | None
    two_sided: bool


class Materials:
    """Makes a Material where a triangle first uses it; -1 stands for glTF's default material.

    Reflectance is baseColorFactor (diffuseFactor of KHR_materials_pbrSpecularGlossiness) times the mean
    linear texel; emission is emissiveFactor times KHR_materials_emissive_strength times the mean texel.
    """

    def __init__(self, document: Document, textures: Textures) -> None:
        self._document = document
        self._textures = textures
        self._names = UniqueNames()
        self._looks: dict[int, _Look] = {}
        self._made: dict[tuple[int, str | None], Material] = {}

    @property
    def used(self) -> list[Material]:
        """Every material made so far."""
        return list(self._made.values())

    def material(self, index: int, node_group: str | None, default_group: str | None) -> Material:
        """The material, in the light group that a luminous triangle of it belongs to.

        The node's extras.group comes before the material's, and that before `default_group`.
        """
        look = self._look(index)
        group = (node_group or look.group or default_group) if look.emission.any() else None
        key = (index, group)
        if key not in self._made:
            # A material in several groups becomes several: the first keeps the name.
            first = all(made != index for made, _ in self._made)
            name = look.name if first else self._names.take(f"{look.name} [{group or 'own'}]")
            self._made[key] = Material(name, look.reflectance, look.emission, group, look.two_sided)
        return self._made[key]

    def _look(self, index: int) -> _Look:
        if index not in self._looks:
            self._looks[index] = self._read(index) if index >= 0 else self._default()
        return self._looks[index]

    def _default(self) -> _Look:
        self._document.notes.add("triangles without a material: glTF's default is white, reflectance 1")
        return _Look(self._names.take("default"), np.ones(3), np.zeros(3), None, False)

    def _read(self, index: int) -> _Look:
        source, place = self._document.gltf.materials[index], f"materials[{index}]"
        name = self._names.take(source.name or f"material{index}")
        _note_unhonoured(source, name, self._document.notes)
        reflectance = self._base_colour(source, place, name)
        strength = source.extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)
        emission = np.array(source.emissiveFactor) * strength
        if (emission < 0).any():
            raise malformed(f"{place}: emission", emission.tolist(), "no negative channel")
        if emission.any():
            emission = emission * self._mean(source.emissiveTexture, f"{place}.emissiveTexture", name)
        if reflectance.max() > WHITE:
            self._document.notes.add(
                f"materials reflect more than {WHITE:.0%}, as no real surface does", name
            )
        return _Look(name, reflectance, emission, source.extras.get("group"), bool(source.doubleSided))

    def _base_colour(self, source: Any, place: str, name: str) -> np.ndarray:
        glossy = source.extensions.get("KHR_materials_pbrSpecularGlossiness")
        if glossy is not None:
            self._document.notes.add(
                "KHR_materials_pbrSpecularGlossiness: only the diffuse part is honoured", name
            )
            factor, texture = glossy.get("diffuseFactor"), glossy.get("diffuseTexture")
            texture_place = f"{place}.extensions.KHR_materials_pbrSpecularGlossiness.diffuseTexture"
            texel = self._mean(texture, texture_place, name)
        else:
            pbr = source.pbrMetallicRoughness
            factor = pbr.baseColorFactor if pbr else None
            texel = self._mean(pbr.baseColorTexture if pbr else None, f"{place}.baseColorTexture", name)
        return np.clip(np.array((factor or (1.0, 1.0, 1.0))[:3]) * texel, 0.0, 1.0)

    def _mean(self, reference: Any, place: str, name: str) -> np.ndarray:
        if reference is None:
            return np.ones(3)
        self._document.notes.add("textures count with their mean colour", name)
        return self._textures.mean(reference.index, place)


def _note_unhonoured(source: Any, name: str, notes: Notes) -> None:
    pbr = source.pbrMetallicRoughness
    glossy = "KHR_materials_pbrSpecularGlossiness" in source.extensions
    if not glossy and (pbr is None or pbr.metallicFactor > 0):
        notes.add("metals count as diffuse", name)
    if source.alphaMode not in (None, "OPAQUE"):
        notes.add("transparency is not honoured: surfaces count as opaque", name)
    if source.normalTexture is not None:
        notes.add("normal maps are not honoured", name)
    if source.occlusionTexture is not None:
        notes.add("occlusion maps are not honoured", name)
