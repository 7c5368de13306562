# SPDX-License-Identifier: Apache-2.0
"""Converts glTF materials to diffuse reflectance, emission, and what light passes them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from deltalux.errors import FormatError, SceneError
from deltalux.io.diagnostics import (
    MEAN_GLOW,
    MISSING,
    UNREADABLE,
    Notes,
    UniqueNames,
    malformed,
)
from deltalux.io.glass import AS_BOARD, OPAQUE, Transparency
from deltalux.io.used_texels import SimilarMeans, means_on, with_means
from deltalux.scene import Material
from deltalux.scene.look import ALPHA_MODES, PLAIN, Look, Texture
from deltalux.scene.surfaces import MOST_INDEX, PaneSurface, Surface
from deltalux.texels import linear_to_srgb

from .document import Document
from .schema import LIT_PANE, LIT_REFLECTANCE
from .textures import TRANSFORM, Textures

LEAST_MEAN = 1e-3  # of a texture: factors of darker ones would be beyond all others
WHITE = 0.98  # largest reflectance: only mirrors reflect more, and paths between such walls are very long
TOO_WHITE = f"materials reflect more than {WHITE:.0%}, as no real surface does"

TRANSMISSION = "KHR_materials_transmission"
GLOSSY = "KHR_materials_pbrSpecularGlossiness"


@dataclass(frozen=True)
class _Read:
    """One material of the file, before its light groups are known.

    `colour` and `glow` are factors of the means of its textures.
    """

    name: str
    colour: np.ndarray
    glow: np.ndarray
    group: str | None = None
    two_sided: bool = False
    look: Look = PLAIN
    transparency: Transparency = OPAQUE
    pane: PaneSurface | None = None  # of a lit file, instead

    def surface(self, glass: str, notes: Notes) -> Surface:
        """How it scatters light; tells of what is lost. What passes glass has the base colour."""
        if self.pane is not None and glass != AS_BOARD:
            return self.pane
        tint = tuple(self.reflectance.tolist())
        own = replace(self.transparency, tint=tint, glows=bool(self.emission.any()))
        return own.surface(glass, self.name, notes)

    @property
    def reflectance(self) -> np.ndarray:
        """(3,) with the mean of its texture."""
        return np.clip(self.colour * _mean(self.look.colour), 0.0, 1.0)

    @property
    def emission(self) -> np.ndarray:
        """(3,) with the mean of its texture."""
        return self.glow * _mean(self.look.glow)


@dataclass(frozen=True)
class _Variant:
    """A material of a number beyond the file's: another one, tinted or with other texels on some object."""

    of: int
    tint: np.ndarray | None = None
    means: np.ndarray | None = None  # (6,), of `means_on`
    user: str = ""  # the first object that has it


class Materials:
    """Makes a Material when a triangle first uses it; -1 is glTF's default material.

    Reflectance is baseColorFactor (diffuseFactor of KHR_materials_pbrSpecularGlossiness) times the mean
    linear texel that an object uses, and times the vertex colour of `tinted` ones; emission is emissiveFactor
    times KHR_materials_emissive_strength times the mean texel. Without a material it is `missing`.
    """

    def __init__(self, document: Document, textures: Textures, glass: str, missing: float) -> None:
        self._glass = glass
        self._missing = missing
        self._document = document
        self._textures = textures
        self._variants: list[_Variant] = []  # of numbers beyond the file's materials
        self._tinted: dict[tuple[int, bytes], int] = {}
        self._similar: dict[int, tuple[SimilarMeans, list[int]]] = {}
        self._read_ones: dict[int, _Read] = {}
        self._labels = UniqueNames()
        self.begin()

    def begin(self) -> None:
        """Discard the materials made so far; later ones may have other groups."""
        self._names = UniqueNames()
        self._plain: dict[int, str] = {}  # the first name of each of the file's materials and tints
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
        emission = found.emission
        group = (node_group or found.group or default_group) if emission.any() else None
        key = (index, group)
        if key not in self._made:
            # A material in several groups becomes several materials; the first one keeps the name.
            first = all(made != index for made, _ in self._made)
            name = found.name if first else self._names.take(f"{found.name} [{group or 'own'}]")
            reflectance, surface = found.reflectance, found.surface(self._glass, self._document.notes)
            is_glass = isinstance(surface, PaneSurface) and surface.transmission == 1
            if reflectance.max() > WHITE and not is_glass:
                self._document.notes.add(TOO_WHITE, found.name)
            self._made[key] = Material(
                name, reflectance, emission, group, found.two_sided, found.look, surface
            )
        return self._made[key]

    def tinted(self, index: int, colours: np.ndarray) -> np.ndarray:
        """Numbers (k,) for `material` of a material whose reflectance is multiplied by `colours` (k, 3).

        Without a material they are the reflectance, unless all are white, which says nothing.
        """
        plain = (colours == 1).all(axis=1)
        kept = plain if index >= 0 else np.full(len(colours), plain.all())
        numbers = [
            index if keep else self._tint(index, colour) for keep, colour in zip(kept, colours, strict=True)
        ]
        return np.array(numbers, np.int64)

    def _tint(self, index: int, colour: np.ndarray) -> int:
        key = (index, colour.tobytes())
        if key not in self._tinted:
            self._tinted[key] = self._new(_Variant(index, tint=colour))
        return self._tinted[key]

    def _new(self, variant: _Variant) -> int:
        self._variants.append(variant)
        return len(self._document.gltf.materials) + len(self._variants) - 1

    def on_object(
        self, numbers: np.ndarray, coordinates: np.ndarray | None, areas: np.ndarray, user: str
    ) -> np.ndarray:
        """Numbers (m,) for `material` of an object's triangles, by the texels that they use.

        Parameters
        ----------
        numbers : (m,) of the file's materials, or tinted ones
        coordinates : (m, 3, 2) of the corners; None without
        areas : (m,)
        user : the object's name
        """
        result = numbers.copy()
        for number in np.unique(numbers).tolist():
            look = self._read_at(number).look
            if not look.textures:
                continue
            own = numbers == number
            places = None if coordinates is None else coordinates[own]
            means = means_on(look, self._textures.texels, places, areas[own])
            similar, made = self._similar.setdefault(number, (SimilarMeans(), []))
            which = similar.number(means)
            if which == len(made):
                made.append(self._new(_Variant(number, means=means, user=user)))
            result[own] = made[which]
        return result

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
        transparency = _transparency(source, f"materials[{index}]")
        found = transparency.leaves_out(self._glass)
        if found:
            transparency.surface(self._glass, source.name or f"material{index}", self._document.notes)
        return found

    def _found_at(self, number: int) -> _Read:
        if number not in self._found:
            found, variant = self._read_at(number), self._variant(number)
            on_object = variant is not None and variant.means is not None
            origin, user = (variant.of, variant.user) if variant and on_object else (number, "")
            if origin in self._plain:
                name = self._names.take(f"{self._plain[origin]} on {user}")
            else:
                name = self._plain[origin] = self._names.take(found.name)
            self._found[number] = replace(found, name=name)
        return self._found[number]

    def _variant(self, number: int) -> _Variant | None:
        beyond = number - len(self._document.gltf.materials)
        return self._variants[beyond] if beyond >= 0 else None

    def _read_at(self, number: int) -> _Read:
        """A material, read once; its name may be that of others, too."""
        if number not in self._read_ones:
            variant = self._variant(number)
            if variant is not None:
                white = _Read("default", np.ones(3), np.zeros(3))
                found = white if variant.of < 0 else self._read_at(variant.of)
                self._read_ones[number] = _varied(found, variant)
            else:
                self._read_ones[number] = self._read(number) if number >= 0 else self._default()
        return self._read_ones[number]

    def _default(self) -> _Read:
        self._document.notes.add(MISSING.format(self._missing))
        return _Read(self._labels.take("default"), np.full(3, self._missing), np.zeros(3))

    def _read(self, index: int) -> _Read:
        source, place = self._document.gltf.materials[index], f"materials[{index}]"
        name = self._labels.take(source.name or f"material{index}")
        _note_unhonoured(source, name, self._document.notes)
        texture, factor = _base_colour(source)
        if GLOSSY in source.extensions:
            self._document.notes.add(f"{GLOSSY}: only the diffuse part is honoured", name)
            texture_place = f"{place}.extensions.{GLOSSY}.diffuseTexture"
        else:
            texture_place = f"{place}.baseColorTexture"
        colour, glow = self._texture(texture, texture_place, name), None
        emission = np.array(source.emissiveFactor) * _strength(source)
        if (emission < 0).any():
            raise malformed(f"{place}: emission", emission.tolist(), "no negative channel")
        if emission.any():
            glow = self._texture(source.emissiveTexture, f"{place}.emissiveTexture", name)
        if glow is not None and _set_of(source.emissiveTexture) != self.coordinate_set(index):
            emission, glow = emission * glow.mean, None  # those coordinates are not read
            self._document.notes.add(MEAN_GLOW, name)
        mode = source.alphaMode if source.alphaMode in ALPHA_MODES else PLAIN.alpha_mode
        cutoff = PLAIN.alpha_cutoff if source.alphaCutoff is None else max(source.alphaCutoff, 0.0)
        look = Look(colour, glow, mode, float(np.clip(factor[3], 0, 1)), cutoff)
        colour_factor = np.array(factor[:3])
        pane = None
        if LIT_PANE in source.extras:  # of a lit file, whose alpha is for viewers
            pane = _lit_pane(source.extras[LIT_PANE], f"{place}.extras.{LIT_PANE}")
        if LIT_REFLECTANCE in source.extras:
            colour_factor = np.array(source.extras[LIT_REFLECTANCE], np.float64)
            if colour is not None and (mode == "MASK" or pane is not None):
                # The texture's alpha counts, and so the reflectance is that of its mean.
                colour_factor = np.divide(
                    colour_factor, colour.mean, out=colour_factor, where=colour.mean > LEAST_MEAN
                )
            else:  # the base colour may be that of a lamp
                look = replace(look, colour=None)
        group = source.extras.get("group")
        transparency = replace(
            _transparency(source, place),
            varies=mode == "BLEND" and colour is not None and self._textures.texels(colour).has_gaps,
        )
        two_sided = bool(source.doubleSided)
        return _Read(name, colour_factor, emission, group, two_sided, look, transparency, pane)

    def _texture(self, reference: Any, place: str, name: str) -> Texture | None:
        if reference is None:
            return None
        try:
            found = self._textures.texture(reference, place)
        except FormatError as error:
            self._document.notes.add(UNREADABLE, f'material "{name}", {error}')
            return None
        return found


def _lit_pane(parameters: Any, place: str) -> PaneSurface:
    try:
        return PaneSurface(*parameters)
    except SceneError:
        raise malformed(place, parameters, "the six parameters of a pane") from None


def _varied(found: _Read, variant: _Variant) -> _Read:
    if variant.means is not None:
        return replace(found, look=with_means(found.look, variant.means))
    assert variant.tint is not None
    code = "".join(f"{round(255 * c):02x}" for c in linear_to_srgb(variant.tint))
    return replace(found, name=f"{found.name} #{code}", colour=found.colour * variant.tint)


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


def _transparency(source: Any, place: str) -> Transparency:
    """What passes a material, but for the alpha of its texture."""
    _, factor = _base_colour(source)
    share = source.extensions.get(TRANSMISSION, {}).get("transmissionFactor", 0.0)
    index = source.extensions.get("KHR_materials_ior", {}).get("ior", 1.5)
    if not 0 <= share <= 1:
        raise malformed(f"{place}: transmissionFactor", share, "0 to 1")
    if not (index == 0 or index >= 1):
        raise malformed(f"{place}: ior", index, "0, or 1 and more")
    return Transparency(
        float(np.clip(factor[3], 0, 1)) if source.alphaMode == "BLEND" else 1.0,
        share,
        min(index or 1.5, MOST_INDEX),  # 0 says nothing of glass
        glows=any(source.emissiveFactor) and _strength(source) > 0,
    )


def _strength(source: Any) -> float:
    return source.extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1.0)


def _note_unhonoured(source: Any, name: str, notes: Notes) -> None:
    pbr = source.pbrMetallicRoughness
    if GLOSSY not in source.extensions and (pbr is None or pbr.metallicFactor > 0):
        notes.add("metals count as diffuse", name)
    if any(key in source.extensions.get(TRANSMISSION, {}) for key in ("transmissionTexture",)):
        notes.add("textures of transmission are not honoured: the factor counts", name)
    if "KHR_materials_volume" in source.extensions:
        notes.add("solid glass counts as thin: light passes its surfaces straight", name)
    if source.normalTexture is not None:
        notes.add("normal maps are not honoured", name)
    if source.occlusionTexture is not None:
        notes.add("occlusion maps are not honoured", name)
