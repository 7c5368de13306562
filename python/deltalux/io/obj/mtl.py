# SPDX-License-Identifier: Apache-2.0
"""MTL files of OBJ: Kd and Ke, each with the mean of the texels that an object uses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from deltalux.errors import FormatError
from deltalux.io.diagnostics import (
    MISSING,
    UNREADABLE,
    Notes,
    UniqueNames,
    clean_name,
    malformed,
)  # fmt: skip
from deltalux.io.files import is_beside, read_beside
from deltalux.io.glass import Transparency
from deltalux.io.used_texels import SimilarMeans, means_on, with_means
from deltalux.scene import Material
from deltalux.scene.look import WRAPS, Look, Texture
from deltalux.texels import MAX_FILE_BYTES, Texels, read_texels

MOST_OPTION = 1e9  # options' numbers of this size or more are ignored
MOST_WORDS = 16  # of a file name; more are several names
# Statements that name a texture file.
TEXTURES = {
    "map_Kd", "map_Ke", "map_Ka", "map_Ks", "map_Ns", "map_d", "map_bump", "map_Bump", "map_Pr", "map_Pm",
    "map_Ps", "bump", "disp", "decal", "norm", "refl",
}  # fmt: skip
IGNORED = {"Ka", "Ni", "illum", "Tf", "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor", "sharpness"}


@dataclass
class _Map:
    """A statement that names a texture: its file, and the options that map it."""

    path: str
    offset: tuple[float, float] = (0.0, 0.0)
    scale: tuple[float, float] = (1.0, 1.0)
    clamped: bool = False

    def texture(self, image: bytes, texels: Texels) -> Texture:
        """The texture in glTF's coordinates, whose v points down; OBJ's v points up."""
        return Texture(
            image,
            texels.mean,
            (WRAPS[1] if self.clamped else WRAPS[0],) * 2,
            offset=(self.offset[0], 1 - self.scale[1] - self.offset[1]),
            scale=self.scale,
            by_alpha=True,
        )


@dataclass
class _Entry:
    colours: dict[str, np.ndarray] = field(default_factory=dict)  # Kd, Ke
    textures: dict[str, _Map] = field(default_factory=dict)  # for Kd, Ke
    shares: dict[str, float] = field(default_factory=dict)  # of light that passes, as d and Tr have it

    @property
    def passes(self) -> float:
        """Share of light that passes; some programs write a Tr that means the opposite, beside a d."""
        return self.shares.get("d", self.shares.get("Tr", 0.0))

    @property
    def transparency(self) -> Transparency:
        glows = bool(self.colours.get("Ke", np.zeros(3)).any())
        return Transparency(1 - self.passes, glows=glows)


@dataclass
class _Made:
    """Materials of one name: by the means of their textures on the objects that have them."""

    similar: SimilarMeans = field(default_factory=SimilarMeans)
    materials: list[Material] = field(default_factory=list)


class MaterialLibrary:
    """Materials by name, from any number of MTL files in or below `folder`.

    `glass`: see `deltalux.load`; `missing`: reflectance of materials that no file gives any.
    """

    def __init__(self, folder: Path, notes: Notes, glass: str, missing: float) -> None:
        self._glass, self._missing = glass, missing
        self._folder = folder
        self._notes = notes
        self._files: dict[Path, None] = {}
        self._read: set[str] = set()
        self._images: dict[str, tuple[bytes, Texels]] = {}  # encoded images and their colours, by path
        self._texels: dict[int, Texels] = {}  # by the identity of the encoded image
        self._entries: dict[str, _Entry] = {}
        self._plain: dict[str, Material] = {}  # with the means of whole images
        self._made: dict[str, _Made] = {}
        self._names = UniqueNames()

    @property
    def files(self) -> tuple[Path, ...]:
        """The MTL files and all textures that they name, read or not."""
        return tuple(self._files)

    @property
    def materials(self) -> list[Material]:
        """Every material made so far."""
        return [material for made in self._made.values() for material in made.materials]

    def read_all(self, words: Sequence[str], where: str) -> None:
        """Add the materials of the files that a mtllib statement names; names may contain spaces.

        At each word the longest name counts of which there is a file, else what ends with the next ".mtl".
        """
        first = 0
        while first < len(words):
            ends = range(min(first + MOST_WORDS, len(words)), first, -1)
            there = (end for end in ends if is_beside(self._folder, _path(words[first:end])))
            guessed = (end for end in reversed(ends) if words[end - 1].lower().endswith(".mtl"))
            end = next(there, next(guessed, len(words)))
            self._read_file(_path(words[first:end]), where)
            first = end

    def _read_file(self, filename: str, where: str) -> None:
        """Add the materials of a file, once; an absent file is only a warning: the geometry is valid."""
        place, path = clean_name(filename), self._named(filename)
        if path in self._read:
            return
        self._read.add(path)
        try:
            data = read_beside(self._folder, path, where)
        except FormatError as error:
            self._notes.add("MTL files that cannot be read", str(error))
            return
        name, entry = "", _Entry()
        for number, line in enumerate(data.decode("utf-8", "replace").split("\n"), 1):
            key, *rest = line.split("#", 1)[0].split() or [""]
            if key == "newmtl":
                name = clean_name(" ".join(rest))
                entry = self._entries.setdefault(name, _Entry())
            elif key in ("Kd", "Ke"):
                entry.colours[key] = _colour(rest, f"{place} line {number}")
            elif key in TEXTURES and rest:
                # Options ("-s 1 1 1") come first; only without them can a file name contain spaces.
                texture = self._named(rest[-1] if rest[0].startswith("-") else " ".join(rest))
                if key in ("map_Kd", "map_Ke"):
                    entry.textures[key[4:]] = _Map(texture, *_options(rest[:-1]))
                else:
                    self._note_unhonoured(key)
            elif (share := _passed(key, rest)) is not None:
                entry.shares[key] = share
            elif key and key not in IGNORED | {"d", "Tr", "Ks", "Ns"}:
                self._note_unhonoured(key)

    def _named(self, filename: str) -> str:
        """The path of a file with forward slashes; records the file as a part of the scene."""
        path = filename.replace("\\", "/")
        self._files[self._folder / path] = None
        return path

    def _note_unhonoured(self, key: str) -> None:
        self._notes.add("MTL statements that are not honoured", clean_name(key))

    def textured(self, name: str) -> bool:
        """Whether an MTL file gives the material of that name a texture."""
        return name in self._entries and bool(self._entries[name].textures)

    def leaves_out(self, name: str) -> bool:
        """Whether faces of that material are none."""
        return name in self._entries and self._entries[name].transparency.leaves_out(self._glass)

    def note_transparent(self) -> None:
        """Warn of materials that let light through, used or not."""
        for name, entry in self._entries.items():
            entry.transparency.surface(self._glass, name, self._notes)

    def material(self, name: str, user: str, coordinates: np.ndarray | None, areas: np.ndarray) -> str:
        """Name of the material of that name on an object, which uses a part of its textures.

        Parameters
        ----------
        name : as the OBJ file has it; `missing`, with a warning, if no MTL file defines it
        user : the object's name
        coordinates : (m, 3, 2) of the corners of the object's triangles of that material, or None
        areas : (m,)
        """
        if name not in self._plain:
            self._plain[name] = self._whole(name)
        whole, made = self._plain[name], self._made.setdefault(name, _Made())
        means = means_on(whole.look, self._texels_of, coordinates, areas)
        number = made.similar.number(means)
        if number == len(made.materials):
            own = self._names.take(f"{name} on {user}" if made.materials else name)
            made.materials.append(self._with_means(replace(whole, name=own), name, means))
        return made.materials[number].name

    def _texels_of(self, texture: Texture) -> Texels:
        return self._texels[id(texture.image)]

    def _with_means(self, material: Material, name: str, means: np.ndarray) -> Material:
        factors = self._factors(name, material.look)
        return replace(
            material,
            reflectance=np.clip(factors["Kd"] * means[:3], 0.0, 1.0),
            emission=factors["Ke"] * means[3:],
            look=with_means(material.look, means),
        )

    def _factors(self, name: str, look: Look) -> dict[str, np.ndarray]:
        """Kd and Ke; a texture without Kd counts as it is."""
        given = self._entries[name].colours if name in self._entries else {}
        missing = self._missing if look.colour is None else 1.0
        return {"Kd": np.full(3, missing), "Ke": np.zeros(3)} | given

    def _whole(self, name: str) -> Material:
        """The material without the factors of its textures."""
        entry = self._entries.get(name, _Entry())
        colour, glow = self._texture(entry, "Kd", name), None
        if colour is None and "Kd" not in entry.colours:
            self._notes.add(MISSING.format(self._missing), name)
        if entry.colours.get("Ke", np.zeros(3)).any():
            glow = self._texture(entry, "Ke", name)
        surface = entry.transparency.surface(self._glass, name, self._notes)
        return Material(name, look=Look(colour, glow), surface=surface)

    def _texture(self, entry: _Entry, key: str, name: str) -> Texture | None:
        if key not in entry.textures:
            return None
        place = f'material "{name}" map_{key}'
        found = entry.textures[key]
        try:
            if found.path not in self._images:
                data = read_beside(self._folder, found.path, place, MAX_FILE_BYTES)
                self._images[found.path] = data, read_texels(data, place)
                self._texels[id(data)] = self._images[found.path][1]
        except FormatError as error:
            self._notes.add(UNREADABLE, str(error))
            return None
        return found.texture(*self._images[found.path])


def _path(words: Sequence[str]) -> str:
    """A file name of these words, with forward slashes; some programs put it in quotes."""
    return " ".join(words).strip('"').replace("\\", "/")


def _options(words: list[str]) -> tuple[tuple[float, float], tuple[float, float], bool]:
    """Offset, scale and whether it is clamped: -o, -s and -clamp; other words than numbers are ignored."""
    found = {"-o": [0.0, 0.0], "-s": [1.0, 1.0]}
    for i, word in enumerate(words):
        if word in found:
            for axis, text in enumerate(words[i + 1 : i + 3]):
                try:
                    value = float(text)
                except ValueError:  # the next option begins; a single number is for u only
                    break
                found[word][axis] = value if abs(value) < MOST_OPTION else found[word][axis]
    clamped = "-clamp on" in " ".join(words)
    return (found["-o"][0], found["-o"][1]), (found["-s"][0], found["-s"][1]), clamped


def _passed(key: str, words: list[str]) -> float | None:
    """Share of the light that passes by a statement: "d", or the inverse "Tr" of some programs; else None."""
    try:
        value = float(words[-1]) if words and key in ("d", "Tr") else np.nan
    except ValueError:
        return None
    return None if np.isnan(value) else float(np.clip(1 - value if key == "d" else value, 0, 1))


def _colour(words: list[str], where: str) -> np.ndarray:
    try:
        values = np.array([float(word) for word in words[:3]])
    except ValueError:
        values = np.zeros(0)
    if len(values) == 1:
        values = np.repeat(values, 3)
    if len(values) != 3 or not (np.isfinite(values) & (values >= 0) & (values < 1e30)).all():
        raise malformed(where, repr(" ".join(words))[:60], "three numbers that are not negative")
    return values
