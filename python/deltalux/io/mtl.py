# SPDX-License-Identifier: Apache-2.0
"""MTL files of OBJ: Kd and Ke, each with the mean of its texture."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from deltalux.errors import FormatError
from deltalux.scene import Material

from .diagnostics import Notes, clean_name, malformed
from .files import read_beside
from .texels import MAX_FILE_BYTES, mean_linear_texel

GREY = 0.5  # of materials that the MTL files do not define
# Statements that name a file.
TEXTURES = {
    "map_Kd", "map_Ke", "map_Ka", "map_Ks", "map_Ns", "map_d", "map_bump", "map_Bump", "map_Pr", "map_Pm",
    "map_Ps", "bump", "disp", "decal", "norm", "refl",
}  # fmt: skip
IGNORED = {"Ka", "Ni", "illum", "Tf", "Pr", "Pm", "Ps", "Pc", "Pcr", "aniso", "anisor", "sharpness"}


@dataclass
class _Entry:
    colours: dict[str, np.ndarray] = field(default_factory=dict)  # Kd, Ke
    textures: dict[str, str] = field(default_factory=dict)  # of Kd, Ke


class MaterialLibrary:
    """Materials by name, from any number of MTL files in or below `folder`."""

    def __init__(self, folder: Path, notes: Notes) -> None:
        self._folder = folder
        self._notes = notes
        self._files: dict[Path, None] = {}
        self._read: set[str] = set()
        self._means: dict[str, np.ndarray] = {}  # of textures, by path
        self._entries: dict[str, _Entry] = {}

    @property
    def files(self) -> tuple[Path, ...]:
        """The MTL files and all textures that they name, read or not."""
        return tuple(self._files)

    def read(self, filename: str, where: str) -> None:
        """Add the materials of a file, once; an absent file is a warning: the geometry is still good."""
        place, path = clean_name(filename), self._named(filename)
        if path in self._read:
            return
        self._read.add(path)
        try:
            data = read_beside(self._folder, path, where)
        except FormatError as error:
            self._notes.add("MTL files that cannot be read", str(error))
            return
        entry = _Entry()
        for number, line in enumerate(data.decode("utf-8", "replace").split("\n"), 1):
            key, *rest = line.split("#", 1)[0].split() or [""]
            if key == "newmtl":
                entry = self._entries.setdefault(clean_name(" ".join(rest)), _Entry())
            elif key in ("Kd", "Ke"):
                entry.colours[key] = _colour(rest, f"{place} line {number}")
            elif key in TEXTURES and rest:
                # Options ("-s 1 1 1") come first; only without them can a file name hold spaces.
                texture = self._named(rest[-1] if rest[0].startswith("-") else " ".join(rest))
                if key in ("map_Kd", "map_Ke"):
                    entry.textures[key[4:]] = texture
                else:
                    self._note_unhonoured(key)
            elif (key == "d" and rest != ["1"]) or (key == "Tr" and rest != ["0"]):
                self._notes.add("transparency may not be honoured: surfaces count as opaque", place)
            elif key and key not in IGNORED | {"d", "Tr", "Ks", "Ns"}:
                self._note_unhonoured(key)

    def _named(self, filename: str) -> str:
        """The path of a file that belongs to the scene, as this system writes it."""
        path = filename.replace("\\", "/")
        self._files[self._folder / path] = None
        return path

    def _note_unhonoured(self, key: str) -> None:
        self._notes.add("MTL statements that are not honoured", clean_name(key))

    def material(self, name: str) -> Material:
        """The material of that name; grey, with a warning, where no MTL file defines it."""
        entry = self._entries.get(name)
        if entry is None:
            self._notes.add(f"materials that no MTL file defines are grey ({GREY})", name)
            return Material(name, (GREY,) * 3)
        reflectance = np.clip(
            entry.colours.get("Kd", np.full(3, GREY)) * self._texel(entry, "Kd", name), 0, 1
        )
        emission = entry.colours.get("Ke", np.zeros(3))
        if emission.any():
            emission = emission * self._texel(entry, "Ke", name)
        return Material(name, np.clip(reflectance, 0.0, 1.0), emission)

    def _texel(self, entry: _Entry, key: str, name: str) -> np.ndarray:
        if key not in entry.textures:
            return np.ones(3)
        place = f'material "{name}" map_{key}'
        path = entry.textures[key]
        try:
            if path not in self._means:
                data = read_beside(self._folder, path, place, MAX_FILE_BYTES)
                self._means[path] = mean_linear_texel(data, place)
        except FormatError as error:
            self._notes.add("textures that cannot be read: the plain colour counts", str(error))
            return np.ones(3)
        self._notes.add("textures count with their mean colour", name)
        return self._means[path]


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
