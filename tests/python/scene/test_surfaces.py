# SPDX-License-Identifier: Apache-2.0
"""Kinds of surfaces: what is known of each, and what becomes of one that others do not know."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import deltalux as dl
import numpy as np
import pytest
from deltalux import _core
from deltalux.scene import Surface, replace_scene
from deltalux.scene.arrays import NUMBER, VECTOR
from deltalux.scene.flatten import flatten
from deltalux.scene.surfaces import KINDS
from rooms import room, samples_in


@dataclass(frozen=True, eq=False, init=False)
class Velvet(Surface):
    """A kind that neither the core nor session files know."""

    colour: np.ndarray
    depth: float

    kind = "velvet"
    fields: ClassVar = {"colour": VECTOR, "depth": NUMBER}
    reads_texture = True

    def __init__(self, colour: tuple[float, ...], depth: float) -> None:
        super().__init__(colour=colour, depth=depth)


def of(surface: Surface) -> dl.Scene:
    """The room, all of whose materials have this surface."""
    scene = room()
    return replace_scene(scene, materials=[replace(m, surface=surface) for m in scene.materials])


def test_a_surface_of_an_unknown_kind_is_refused() -> None:
    scene, known = of(Velvet((1, 0, 0), 2)), ", ".join(f'"{kind}"' for kind in KINDS)
    with pytest.raises(dl.SceneError, match=f'kind of surface: found "velvet", expected one of {known}$'):
        dl.Session(scene, samples_in(scene))


def test_the_core_has_every_kind() -> None:
    for kind in KINDS:
        _core.Scene().add_material("x", (0.5,) * 3, (0,) * 3, False, kind, ())


def test_a_surface_checks_its_fields() -> None:
    velvet = Velvet((1, 0.5, 0), 2)
    assert velvet.depth == 2.0
    assert np.array_equal(velvet.colour, (1, 0.5, 0)) and not velvet.colour.flags.writeable
    with pytest.raises(dl.SceneError, match=r"velvet surface: colour: found shape \(2,\)"):
        Velvet((1, 0), 2)


def test_a_material_is_diffuse_unless_told_otherwise() -> None:
    assert isinstance(dl.Material("m").surface, dl.DiffuseSurface)
    assert dl.Material("m").surface.parameters() == ()


def test_only_surfaces_that_read_texture_coordinates_cost_memory_for_them(monkeypatch) -> None:
    flat, mesh = flatten(room()), room().meshes[0]
    given = []
    monkeypatch.setattr(_core, "Object", lambda *arguments: given.append(arguments[-1]))
    places = np.arange(6 * len(mesh.triangles), dtype=np.float32).reshape(-1, 3, 2)
    for surface in (dl.DiffuseSurface(), Velvet((1, 0, 0), 2)):
        flat.scene = replace_scene(of(surface), meshes=[replace(mesh, coordinates=places)], lights=[])
        flat.object(flat.scene.meshes[0])
        assert given[-1].shape == (len(mesh.triangles) * surface.reads_texture, 6)
    assert np.array_equal(given[-1].ravel(), places.ravel())


def test_a_surface_comes_back_from_its_file(tmp_path) -> None:
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=200, gather=64) as session:
        session.save(tmp_path / "room.dlx")
    with dl.Session.open(tmp_path / "room.dlx") as session:
        assert [m.surface.kind for m in session.scene.materials] == ["diffuse"] * len(scene.materials)
