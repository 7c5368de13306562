# SPDX-License-Identifier: Apache-2.0
"""What pages draw: arrays, parts and cameras of scene.json."""

from __future__ import annotations

import json

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import Camera, replace_scene
from deltalux.server.drawn.geometry import Geometry, geometry_of
from rooms import room

from viewer.page.two_cells import two_cells
from viewer.page_client import get
from viewer.served_room import make_session

SHAPES = {"detail": (-1,), "copies": (-1,), "coordinates": (-1, 2)}


def arrays_of(geometry: Geometry) -> dict[str, np.ndarray]:
    return {
        name: np.frombuffer(
            geometry.data[a["offset"] : a["offset"] + a["length"]], a["type"][0] + "4"
        ).reshape(SHAPES.get(name, (-1, 3)))
        for name, a in geometry.description["arrays"].items()
    }


@pytest.mark.parametrize("make", [room, dl.scenes.cornell_box])
def test_triangles_of_a_part_have_its_mesh_material_and_side(make):
    scene = make()
    session = dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.8), paths=1000)
    geometry, display = geometry_of(session), session.samples.display
    about, arrays = geometry.description, arrays_of(geometry)
    assert np.array_equal(arrays["points"], display.points.astype(np.float32))
    assert np.array_equal(arrays["normals"], display.normals.astype(np.float32))
    of = {tuple(t): i for i, t in enumerate(display.triangles.tolist())}
    place = 0
    for part in about["parts"]:
        assert part["first"] == place
        place += part["count"]
        mine = [of[tuple(t)] for t in arrays["indices"][part["first"] : place].tolist()]
        assert set(display.triangle_mesh[mine]) == {part["mesh"]}
        assert set(display.triangle_material[mine]) == {part["material"]}
        assert set(display.reversed[mine]) == {part["reversed"]}
        mesh = about["meshes"][part["mesh"]]
        corners = arrays["indices"][part["first"] : place]
        assert corners.min() >= mesh["first_vertex"]
        assert corners.max() < mesh["first_vertex"] + mesh["vertex_count"]
    assert place == about["triangles"] == len(display.triangles)
    keys = [(p["mesh"], p["material"], p["reversed"]) for p in about["parts"]]
    assert keys == sorted(set(keys))
    assert sum(m["vertex_count"] for m in about["meshes"]) == about["vertices"] == len(session.samples)


def test_description_names_what_can_be_edited(session):
    about = geometry_of(session).description
    assert json.loads(json.dumps(about)) == about | {"cameras": json.loads(json.dumps(about["cameras"]))}
    assert [m["name"] for m in about["meshes"] if m["movable"]] == ["block", "lamp"]
    assert about["groups"] == ["desk", "ceiling"]
    assert {m["name"]: m["closed"] for m in about["meshes"]} == {
        "walls": True, "ceiling lamp": True, "block": True, "lamp": True,
    }  # fmt: skip
    sheets = geometry_of(dl.Session(two_cells(), dl.Samples.on_vertices(two_cells(), spacing=0.8)))
    assert [m["name"] for m in sheets.description["meshes"] if not m["closed"]] == ["left cell", "right cell"]
    assert {m["name"]: m["two_sided"] for m in about["materials"]}["ceiling glow"]
    assert about["bounds"] == [list(v) for v in np.array(session.scene.bounds)]


def test_cameras_are_the_scene_s_and_an_automatic_one():
    pose = np.eye(4)
    pose[:3, 3] = (1, 2, 3)
    plan = Camera("plan", pose, height=3)  # a page has no parallel rays
    scene = replace_scene(room(), cameras=[plan, Camera("mine", pose, 0.7)])
    session = dl.Session(scene, dl.Samples.on_vertices(scene, spacing=0.8), paths=1000)
    mine, automatic = geometry_of(session).description["cameras"]
    assert mine == {
        "name": "mine",
        "pose": (1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 1, 2, 3, 1),
        "vertical_fov": 0.7,
    }
    eye = np.array(automatic["pose"][12:15])
    low, high = scene.bounds
    assert ((eye > low - 10) & (eye < high + 10)).all()


def test_samples_without_a_mesh_are_refused():
    scene = room()
    plane = dl.Session(scene, dl.Samples.on_grid((-1, 0.5, -1), (0, 0, 2), (2, 0, 0), 0.5), paths=1000)
    with pytest.raises(
        dl.OptionError, match=r"found 16 samples that are not on the vertices .* leave out --grid"
    ):
        geometry_of(plane)


def test_served_geometry_is_the_session_s(session, serve):
    server = serve(session)
    about = json.load(get(server, "/scene.json"))
    assert about["protocol"] == 1
    assert about["run"]
    assert about["folder"] is False
    assert about["lit"] is True
    response = get(server, "/geometry.bin")
    assert response.headers["cache-control"] == "no-store"
    assert len(response.read()) == sum(a["length"] for a in about["arrays"].values())


def test_a_session_that_is_not_baked_has_no_light_to_wait_for(serve):
    assert json.load(get(serve(make_session()), "/scene.json"))["lit"] is False


def panels(groups: str | None) -> dl.Scene:
    """Two panels of one luminous material, and a floor."""
    corners = np.array([(0, 0, 0), (1, 0, 0), (1, 0, 1), (0, 0, 1)], float)
    triangles = [(0, 1, 2), (0, 2, 3)]
    meshes = [
        dl.Mesh("floor", 4 * corners, [t[::-1] for t in triangles], "wall"),
        dl.Mesh("left", corners + np.array((0, 2, 0)), triangles, "glow"),
        dl.Mesh("right", corners + np.array((2, 2, 0)), triangles, "glow"),
    ]
    materials = [dl.Material("wall"), dl.Material("glow", emission=(9, 9, 9), group=groups)]
    return dl.Scene(meshes, materials, unit="lux")


@pytest.mark.parametrize(
    ("groups", "expected"),
    [
        (None, [("wall", None), ("glow", "left"), ("glow", "right")]),
        ("all", [("wall", None), ("glow", "all")]),
    ],
)
def test_luminous_materials_are_listed_by_their_light_groups(groups, expected):
    scene = panels(groups)
    with dl.Session(scene, dl.Samples.on_vertices(scene, spacing=1), paths=100, gather=8) as session:
        described = geometry_of(session).description
    materials = described["materials"]
    assert [(m["name"], m["group"]) for m in materials] == expected
    assert {m["group"] for m in materials} - {None} == set(described["groups"])
    for part in described["parts"]:
        own, mesh = materials[part["material"]], scene.meshes[part["mesh"]]
        assert own["name"] == mesh.material[0]
        assert own["group"] in (None, groups or mesh.name)
