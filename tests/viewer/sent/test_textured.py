# SPDX-License-Identifier: Apache-2.0
"""Textures of pages: coordinates, vertices repeated at seams with equal values, images."""

from __future__ import annotations

import json
from dataclasses import replace
from urllib.error import HTTPError

import deltalux as dl
import numpy as np
import pytest
from deltalux.outputs.texture_coordinates import TextureCoordinates
from deltalux.scene.look import Look, Texture
from deltalux.server.drawn.drawn_mesh import NONE
from deltalux.server.drawn.geometry import Geometry, geometry_of
from deltalux.server.drawn.values import Values
from deltalux.server.engine import state
from deltalux.server.engine.events import Refined
from rooms import room, translation, with_texture

from viewer.followed import Followed, assert_shown
from viewer.page_client import PageClient, get
from viewer.sent.test_geometry import arrays_of
from viewer.served_room import PATHS


def make_session(scene: dl.Scene, **options) -> dl.Session:
    samples = dl.Samples.on_vertices(scene, spacing=0.6, radius=0.15, detail=options.pop("detail", None))
    return dl.Session(scene, samples, paths=PATHS, threads=2, **{"gather": "off", **options})


def in_triangles_of_the_display(geometry: Geometry, session: dl.Session) -> tuple[np.ndarray, np.ndarray]:
    """Coordinates (m, 3, 2) and points (m, 3, 3) of corners, in the order of the display mesh."""
    arrays, display = arrays_of(geometry), session.samples.display
    order = np.lexsort((display.reversed, display.triangle_material, display.triangle_mesh))
    corners = np.zeros((len(order), 3), int)
    corners[order] = arrays["indices"]
    return arrays["coordinates"][corners], arrays["points"][corners]


def test_every_corner_has_its_place_and_its_coordinates():
    """Coordinates that differ from triangle to triangle: seams everywhere, inside of flat walls, too."""
    with make_session(with_texture(room())) as session:
        geometry, display = geometry_of(session), session.samples.display
        coordinates, points = in_triangles_of_the_display(geometry, session)
        walls = display.triangle_mesh == 0
        expected = TextureCoordinates(session.scene, display).of(np.flatnonzero(walls))
        assert np.array_equal(coordinates[walls], expected)
        assert (coordinates[~walls] == NONE).all()
        assert np.array_equal(points, display.points.astype("f4")[display.triangles])


def test_vertices_are_repeated_where_coordinates_differ_and_only_there():
    with make_session(with_texture(room())) as session:
        geometry = geometry_of(session)
        arrays, copies = arrays_of(geometry), arrays_of(geometry)["copies"]
        assert len(copies) > 20
        assert geometry.description["vertices"] == len(session.samples) + len(copies)
        places = np.concatenate([arrays["points"], arrays["normals"]], axis=1)
        assert np.array_equal(places[copies], places[copies - 1])
        rows = np.concatenate([geometry.drawn.vertices[:, None], arrays["coordinates"]], axis=1)
        assert len(np.unique(rows, axis=0)) == len(rows)
        walls = geometry.description["meshes"][0]
        assert copies.max() < walls["first_vertex"] + walls["vertex_count"]  # the others have no texture


def test_without_textures_nothing_is_repeated_and_no_coordinates_are_sent():
    scene = room()
    plain = [replace(m, look=Look()) for m in with_texture(scene).materials]
    coordinates_only = dl.scene.replace_scene(with_texture(scene), materials=plain)
    for own in (scene, coordinates_only):
        with make_session(own) as session:
            geometry = geometry_of(session)
            assert len(arrays_of(geometry)["coordinates"]) == 0
            assert len(arrays_of(geometry)["copies"]) == 0
            assert geometry.description["vertices"] == len(session.samples)


def test_coordinates_that_say_nothing_count_as_none():
    scene = with_texture(room())
    coordinates = np.array(scene.meshes[0].coordinates)
    coordinates[0, 1] = np.nan
    coordinates[1, 2, 0] = 3e37
    walls = replace(scene.meshes[0], coordinates=coordinates)
    scene = dl.scene.replace_scene(scene, meshes=[walls, *scene.meshes[1:]])
    with make_session(scene) as session:
        shown, _ = in_triangles_of_the_display(geometry_of(session), session)
        display = session.samples.display
        lost = (display.triangle_mesh != 0) | (display.source_triangle < 2)
        assert ((shown == NONE).all(axis=(1, 2)) == lost).all()
        assert np.isfinite(shown).all()


def test_copies_have_the_values_of_what_they_repeat(serve):
    with make_session(with_texture(room())) as session:
        session.bake()
        server = serve(session)
        copies = arrays_of(geometry_of(session))["copies"]
        with PageClient(server) as page:
            page.rest()
            assert np.array_equal(page.rows[copies], page.rows[copies - 1])
            before = page.rows.copy()
            page.ask("move", name="block", pose=translation(-0.4, 0.4, 0.2).T.ravel().tolist())
            page.rest()
            assert (page.rows[copies] != before[copies]).any()
            assert np.array_equal(page.rows[copies], page.rows[copies - 1])


def test_a_mesh_that_follows_shadows_keeps_its_coordinates(monkeypatch):
    monkeypatch.setattr(state, "CALM", 0.05)
    session = make_session(with_texture(room()), gather=16, detail=0.1)
    with session, Followed(session, geometry_of(session)) as followed:
        geometry = followed.until(lambda e: isinstance(e, Refined)).geometry
        values = followed.until(lambda e: isinstance(e, Values))
        followed.engine.stop()
        arrays, display = arrays_of(geometry), session.samples.display
        detail, corners = arrays["detail"], arrays["detail_corners"]
        assert len(np.unique(geometry.drawn.vertices[detail])) == len(display.detail)
        assert len(detail) > len(display.detail)  # some lie on seams
        assert not np.isin(corners, detail).any()
        between = np.einsum("kc,kcx->kx", arrays["detail_weights"], arrays["points"][corners])
        assert np.abs(between - arrays["points"][detail]).max() < 1e-5
        coordinates, points = in_triangles_of_the_display(geometry, session)
        walls = np.flatnonzero(display.triangle_mesh == 0)
        assert np.array_equal(coordinates[walls], TextureCoordinates(session.scene, display).of(walls))
        assert np.array_equal(points, display.points.astype("f4")[display.triangles])
        first = np.searchsorted(geometry.drawn.vertices, np.arange(len(display.points)))
        assert_shown(session, replace(values, rows=values.rows[first]))


def test_images_are_served_and_described_once(serve):
    scene = with_texture(room())
    look = scene.materials[0].look
    other = Texture(
        look.colour.image, (0.1, 0.2, 0.0), (33071, 33648), 9728, 9987,
        offset=(0.25, 0.5), rotation=0.3, scale=(2.0, -3.0),
    )  # fmt: skip
    materials = [replace(m, look=replace(look, colour=other, glow=look.colour)) for m in scene.materials[:2]]
    scene = dl.scene.replace_scene(scene, materials=[*materials, *scene.materials[2:]])
    with make_session(scene) as session:
        server = serve(session)
        told = json.load(get(server, "/scene.json"))["materials"]
        assert told[0]["glow"]["image"] == told[1]["colour"]["image"] == 0
        assert told[2]["colour"] is told[2]["glow"] is None
        assert told[0]["colour"] == {
            "image": 0, "mean": [0.1, 0.2, 0.0], "wrap": [33071, 33648], "mag_filter": 9728,
            "min_filter": 9987, "matrix": other.matrix.ravel().tolist(),
        }  # fmt: skip
        answer = get(server, "/textures/0")
        assert answer.headers["content-type"] == "image/png"
        assert answer.read() == look.colour.image
        for path in ("/textures/1", "/textures/-1", "/textures/x"):
            with pytest.raises(HTTPError, match="404"):
                get(server, path)
        with pytest.raises(HTTPError, match="403"):
            get(server, "/textures/0", token="")


def test_a_texture_s_matrix_is_gltf_s_transform():
    """Offset, rotation and scale, one after the other (KHR_texture_transform); viewers' sign of the angle."""
    own = Texture(with_texture(room()).materials[0].look.colour.image, (1, 1, 1), offset=(0.25, 0.5),
                  rotation=np.pi / 2, scale=(2.0, 3.0))  # fmt: skip
    place = own.matrix @ np.array([[1.0, 0, 1], [0, 1, 1], [0, 0, 1]]).T
    np.testing.assert_allclose(place.T, [(0.25, -1.5), (3.25, 0.5), (0.25, 0.5)], atol=1e-12)
