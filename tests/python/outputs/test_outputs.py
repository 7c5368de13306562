# SPDX-License-Identifier: Apache-2.0
"""Files of results: tables and vertex-coloured glTF."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import GltfBuilder
from deltalux import outputs
from deltalux.errors import FormatError, OptionError
from deltalux.mesh.display_mesh import BOTH, DisplayMesh, refine
from deltalux.outputs.camera import look_at
from deltalux.results import Result
from deltalux.scene import Camera, Material, Mesh, Node, Scene, replace_scene
from deltalux.units import photopic
from written_results import Reader, result_for, shift

SQUARE = [(0, 0, 0), (0, 0, 1), (1, 0, 1), (1, 0, 0)]  # faces up
TWO = [(0, 1, 2), (0, 2, 3)]
MATERIALS = (
    Material("grey", reflectance=(0.5, 0.4, 0.3)),
    Material("lamp", reflectance=(0.2, 0.2, 0.2), emission=(30, 20, 10)),
)


def baked(scene: Scene, spacing: float = 0.3, poses: dict | None = None, **about: object) -> outputs.Baked:
    display = refine(scene, spacing)
    points, normals = display.world(scene, poses)
    return outputs.Baked(result_for(points, normals, **about), scene, display, poses or {})


def plain_scene() -> Scene:
    return Scene([Mesh("floor", SQUARE, TWO, material="grey")], MATERIALS, unit="lux")


# ---- the scene's own files ---------------------------------------------------------------------


@pytest.mark.parametrize("name", ["room.glb", "room.npz", "room.csv", "room.png"])
def test_a_file_of_the_scene_is_not_replaced(tmp_path: Path, name: str) -> None:
    kept = tmp_path / name
    kept.write_bytes(b"the scene")
    scene = Scene([Mesh("floor", SQUARE, TWO, material="grey")], MATERIALS, files=[str(kept)])
    (tmp_path / "link").symlink_to(tmp_path)
    with pytest.raises(OptionError, match=r"found the scene's own file .*; choose another name"):
        outputs.write(tmp_path / "link" / name, baked(scene))
    assert kept.read_bytes() == b"the scene"


def test_the_source_of_a_scene_is_one_of_its_files() -> None:
    assert replace_scene(Scene([], source="room.glb")).files == ("room.glb",)


# ---- tables ------------------------------------------------------------------------------------


def test_npz_keeps_every_bit_and_says_where_it_is_from(tmp_path: Path):
    gradient = np.random.default_rng(0).normal(size=(25, 3, 3))
    given = baked(plain_scene(), 0.5, command="deltalux bake floor.glb", paths=np.int64(1000), seed=1)
    given = outputs.Baked(
        given.result, given.scene, given.display, gradient=gradient[: len(given.result.points)]
    )
    outputs.write(tmp_path / "a.npz", given)
    table = outputs.read(tmp_path / "a.npz")
    for name in ("points", "normals", "irradiance", "standard_error", "radius"):
        np.testing.assert_array_equal(getattr(table, name), getattr(given.result, name))
    np.testing.assert_array_equal(table.gradient, given.gradient)
    assert table.unit == "lux"
    assert table.about["command"] == "deltalux bake floor.glb"
    assert table.about["paths"] == 1000
    assert table.about["program"].startswith("deltalux ")
    assert table.about["quantity"] == "illuminance"
    with np.load(tmp_path / "a.npz", allow_pickle=False) as raw:
        assert json.loads(str(raw["about"])) == table.about
        assert str(raw["unit"]) == "lux"


def test_csv_has_a_header_named_columns_and_the_photopic_value(tmp_path: Path):
    given = baked(plain_scene(), 0.5, command='deltalux bake "a, b.glb"')
    outputs.write(tmp_path / "a.csv", given)
    lines = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()
    header = [line for line in lines if line.startswith("#")]
    assert '# unit: "lux"' in header
    assert '# quantity: "illuminance"' in header
    names = lines[len(header)].split(",")
    assert names == [
        "x",
        "y",
        "z",
        "nx",
        "ny",
        "nz",
        "E_r",
        "E_g",
        "E_b",
        "E",
        "se_r",
        "se_g",
        "se_b",
        "radius",
    ]
    rows = np.loadtxt(lines[len(header) + 1 :], delimiter=",")
    np.testing.assert_allclose(rows[:, 9], photopic(given.result.irradiance), rtol=1e-8)
    table = outputs.read(tmp_path / "a.csv")
    np.testing.assert_allclose(table.irradiance, given.result.irradiance, rtol=1e-8)
    np.testing.assert_allclose(table.standard_error, given.result.standard_error, rtol=1e-8)
    np.testing.assert_allclose(table.radius, given.result.radius, rtol=1e-8)
    assert table.about["command"] == 'deltalux bake "a, b.glb"'


def test_radiometric_results_are_called_irradiance(tmp_path: Path):
    given = baked(plain_scene())
    radiometric = result_for(given.result.points, given.result.normals, unit="W/m2")
    outputs.write(tmp_path / "a.csv", outputs.Baked(radiometric, given.scene))
    table = outputs.read(tmp_path / "a.csv")
    assert (table.unit, table.about["quantity"]) == ("W/m2", "irradiance")


@pytest.mark.parametrize("suffix", [".csv", ".npz"])
def test_truncated_and_foreign_tables_are_refused(tmp_path: Path, suffix: str):
    path = tmp_path / f"a{suffix}"
    outputs.write(path, baked(plain_scene()))
    whole = path.read_bytes()
    for part in (0, 10, len(whole) // 2, len(whole) - 200):
        path.write_bytes(whole[:part])
        with pytest.raises(FormatError, match=r"found a truncated or foreign file .* write it again"):
            outputs.read(path)
    for place in range(0, len(whole), 13):  # compressed data among them, headers, numbers
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        with suppress(FormatError):  # a changed number may still be one
            outputs.read(path)
    path.write_bytes(b"x,y\n1,2\n")
    with pytest.raises(FormatError, match="truncated or foreign"):
        outputs.read(path)
    path.unlink()
    with pytest.raises(FormatError, match="no such file"):
        outputs.read(path)


def test_a_failed_write_leaves_the_earlier_file_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
):
    path = tmp_path / "a.npz"
    path.write_bytes(b"earlier")

    def fail(file, **arrays):
        file.write(b"half")
        raise OSError("disk full")

    monkeypatch.setattr(np, "savez_compressed", fail)
    with pytest.raises(OSError, match="disk full"):
        outputs.write(path, baked(plain_scene()))
    assert path.read_bytes() == b"earlier"
    assert list(tmp_path.iterdir()) == [path]


def test_unknown_suffix_and_absent_folder_are_named(tmp_path: Path):
    with pytest.raises(OptionError, match=r'found suffix ".exr", expected one of .csv, .glb, .npz, .png'):
        outputs.writer_for("picture.exr")
    with pytest.raises(OptionError, match=r"found no folder"):
        outputs.write(tmp_path / "none" / "a.npz", baked(plain_scene()))


@pytest.mark.parametrize("suffix", [".glb", ".png"])
def test_samples_off_the_display_mesh_cannot_become_a_mesh_or_picture(tmp_path: Path, suffix: str):
    given = baked(plain_scene())
    with pytest.raises(OptionError, match=r"found samples that are not on the scene's display mesh"):
        outputs.write(tmp_path / f"a{suffix}", outputs.Baked(given.result, given.scene))
    other = refine(given.scene, 0.1)
    with pytest.raises(OptionError, match=rf"expected one for each of {len(other.points)} samples"):
        outputs.write(tmp_path / f"a{suffix}", outputs.Baked(given.result, given.scene, other))
    assert not list(tmp_path.iterdir())


# ---- glTF --------------------------------------------------------------------------------------


def sorted_rows(array: np.ndarray) -> np.ndarray:
    """Rows in a canonical order, each triangle beginning at its smallest corner."""
    rows = []
    for triangle in np.round(array, 4) + 0.0:
        first = min(range(3), key=lambda k: tuple(triangle[k]))
        rows.append(np.roll(triangle, -first, axis=0).ravel())
    return np.array(sorted(map(tuple, rows)))


def expected_surface(given: outputs.Baked, mesh: str, rows: slice = slice(None)) -> np.ndarray:
    display = given.display
    assert isinstance(display, DisplayMesh)
    index = [m.name for m in given.scene.meshes].index(mesh)
    points, _ = display.world(given.scene, given.poses)
    own = display.triangle_mesh == index
    own &= np.isin(display.source_triangle, np.arange(len(given.scene.meshes[index].triangles))[rows])
    corners = np.concatenate([points, given.result.irradiance], axis=1)[display.triangles[own]]
    return sorted_rows(corners)


def read_surface(reader: Reader, name: str) -> np.ndarray:
    return sorted_rows(np.concatenate(reader.surface(name), axis=2))


def test_glb_of_plain_meshes_has_a_node_for_each_and_movables_by_matrix(tmp_path: Path):
    chair = Mesh("chair", SQUARE, TWO, material="grey", pose=shift(0, 1, 0), movable=True)
    scene = Scene(
        [Mesh("floor", SQUARE, TWO, material="grey", pose=shift(3, 0, 0)), chair], MATERIALS, unit="lux"
    )
    given = baked(scene, poses={"chair": shift(0, 2, 5)})
    outputs.write(tmp_path / "a.glb", given)
    reader = Reader(tmp_path / "a.glb")
    assert [n.name for n in reader.document.nodes] == ["floor", "chair"]
    np.testing.assert_array_equal(reader.world(reader.node("chair")), shift(0, 2, 5))
    for name in ("floor", "chair"):
        np.testing.assert_allclose(read_surface(reader, name), expected_surface(given, name), atol=2e-4)


def tree_scene() -> Scene:
    """Empty root, a mirrored and a flattened node, and a movable of two nodes with an empty between."""
    mirror = np.diag([-2.0, 1, 1, 1]) @ shift(1, 0, 0)
    flat = shift(0, 3, 0) @ np.diag([1.0, 0, 1, 1])
    root = shift(10, 0, 0)
    turned = np.array([[0.0, 0, 1, 0], [0, 1, 0, 0], [-1, 0, 0, 0], [0, 0, 0, 1]])
    cart, box = root @ turned, root @ turned @ shift(0, 1, 0)

    def placed(matrix: np.ndarray) -> np.ndarray:
        return np.array(SQUARE) @ matrix[:3, :3].T + matrix[:3, 3]

    to_cart = np.linalg.inv(cart)
    moving = np.concatenate([placed(np.eye(4)), placed(to_cart @ box)])
    wall = [(0, 2, 1), (0, 3, 2)]  # mirrored, the winding turns
    return Scene(
        [
            Mesh("wall", placed(root @ mirror), wall, material="grey"),
            Mesh("sheet", placed(root @ flat), TWO, material=("grey", "lamp"), material_index=[0, 1]),
            Mesh("cart", moving, [*TWO, (4, 5, 6), (4, 6, 7)], material="grey", pose=cart, movable=True),
        ],
        MATERIALS,
        unit="lux",
        nodes=[
            Node("box", 4, shift(0, 1, 0), (("cart", 2, 2),)),
            Node("root", -1, root),
            Node("wall", 1, mirror, (("wall", 0, 2),)),
            Node("cart", 1, turned, (("cart", 0, 2),)),
            Node("empty", 3, np.eye(4)),
            Node("sheet", 1, flat, (("sheet", 0, 2),)),
        ],
    )


PARTS = {"wall": ("wall", slice(0, 2)), "sheet": ("sheet", slice(0, 2)), "cart": ("cart", slice(0, 2)),
         "box": ("cart", slice(2, 4))}  # fmt: skip


@pytest.mark.parametrize("moved", [False, True])
def test_glb_keeps_names_hierarchy_and_places(tmp_path: Path, moved: bool):
    scene = tree_scene()
    there = np.array([[0.6, 0, 0.8, 1], [0, 1, 0, 2], [-0.8, 0, 0.6, 3], [0, 0, 0, 1]])
    given = baked(scene, poses={"cart": there} if moved else {})
    outputs.write(tmp_path / "a.glb", given)
    reader = Reader(tmp_path / "a.glb")
    assert [n.name for n in reader.document.nodes] == [n.name for n in scene.nodes]
    assert [reader.parents.get(i, -1) for i in range(6)] == [n.parent for n in scene.nodes]
    assert reader.document.scenes[0].nodes == [1]
    for node, (mesh, rows) in PARTS.items():
        np.testing.assert_allclose(read_surface(reader, node), expected_surface(given, mesh, rows), atol=3e-3)
    # The cart's children follow it: only its own matrix is new.
    box = reader.document.nodes[reader.node("box")].matrix
    np.testing.assert_array_equal(np.array(box).reshape(4, 4).T, shift(0, 1, 0))
    if moved:
        np.testing.assert_allclose(reader.world(reader.node("cart")), there, atol=1e-12)


def test_glb_leaves_out_a_removed_object_but_not_its_nodes(tmp_path: Path):
    given = baked(tree_scene(), poses={"cart": None})
    outputs.write(tmp_path / "a.glb", given)
    document = Reader(tmp_path / "a.glb").document
    assert [n.name for n in document.nodes if n.mesh is None] == ["box", "root", "cart", "empty"]


def test_glb_shows_an_added_mesh_that_no_node_names(tmp_path: Path):
    added = Mesh("lamp2", SQUARE, TWO, material="lamp", pose=shift(0, 9, 0), movable=True)
    given = baked(tree_scene().with_mesh(added))
    outputs.write(tmp_path / "a.glb", given)
    reader = Reader(tmp_path / "a.glb")
    assert reader.node("lamp2") in reader.document.scenes[0].nodes
    np.testing.assert_allclose(read_surface(reader, "lamp2"), expected_surface(given, "lamp2"), atol=2e-4)


def test_glb_colours_show_reflectance_times_light(tmp_path: Path):
    lamp = Mesh("lamp", SQUARE, TWO, material="lamp", pose=shift(0, 2, 0))
    scene = Scene([Mesh("floor", SQUARE, TWO, material="grey"), lamp], MATERIALS, unit="lux")
    given = baked(scene)
    outputs.write(tmp_path / "a.glb", given)
    reader = Reader(tmp_path / "a.glb")
    extras = reader.document.asset.extras
    assert (extras["quantity"], extras["unit"]) == ("illuminance", "lux")
    assert "exposure * irradiance" in extras["COLOR_0"]
    exposure = extras["exposure"]
    assert reader.document.extensionsUsed == ["KHR_materials_unlit"]
    for name, material in (("floor", MATERIALS[0]), ("lamp", MATERIALS[1])):
        mesh = reader.document.meshes[reader.document.nodes[reader.node(name)].mesh]
        (primitive,) = mesh.primitives
        written = reader.document.materials[primitive.material]
        assert written.extensions == {"KHR_materials_unlit": {}}
        base = np.array(written.pbrMetallicRoughness.baseColorFactor[:3])
        colour = reader.array(primitive.attributes.COLOR_0)[:, :3] / 65535
        irradiance = reader.array(primitive.attributes._IRRADIANCE)
        light = exposure * (material.reflectance * irradiance + np.pi * material.emission)
        inside = colour < 1
        assert inside.sum() > 20
        np.testing.assert_allclose((base * colour)[inside], light[inside], atol=2e-5)
        assert (light >= base * (1 - 1e-4))[~inside].all()
    errors = np.concatenate(
        [reader.array(p.attributes._STANDARD_ERROR) for m in reader.document.meshes for p in m.primitives]
    )
    assert np.sort(errors.ravel())[-1] == pytest.approx(given.result.standard_error.max(), rel=1e-6)


def test_glb_back_of_a_lamp_does_not_glow(tmp_path: Path):
    scene = Scene([Mesh("lamp", SQUARE, TWO, material="lamp")], MATERIALS, unit="lux")
    display = refine(scene, 0.5, sides=[BOTH, BOTH])
    dark = Result(
        display.points, display.normals, np.zeros((len(display.points), 3)),
        np.zeros((len(display.points), 3)), np.ones(len(display.points)), "lux",
    )  # fmt: skip
    outputs.write(tmp_path / "a.glb", outputs.Baked(dark, scene, display, exposure=0.01))
    reader = Reader(tmp_path / "a.glb")
    (primitive,) = reader.document.meshes[0].primitives
    up = reader.array(primitive.attributes.NORMAL)[:, 1]
    colour = reader.array(primitive.attributes.COLOR_0)[:, :3] / 65535
    np.testing.assert_allclose(
        colour[up > 0], [np.pi * 0.01 * np.array([30, 20, 10])] * (up > 0).sum(), atol=1e-5
    )
    assert (colour[up < 0] == 0).all()
    assert (up < 0).sum() == (up > 0).sum()


def test_glb_of_a_dark_scene_is_black_but_valid(tmp_path: Path):
    given = baked(plain_scene())
    dark = Result(given.result.points, given.result.normals, *(np.zeros((len(given.result.points), 3)),) * 2,
                  given.result.radius, "lux")  # fmt: skip
    outputs.write(tmp_path / "a.glb", outputs.Baked(dark, given.scene, given.display))
    assert Reader(tmp_path / "a.glb").document.asset.extras["exposure"] == 1


def test_glb_is_exposed_for_what_a_picture_shows_not_for_the_lawn(tmp_path: Path):
    """A lawn in the sun, ten times as large as what the camera sees and a thousand times as bright."""
    lawn = Mesh("lawn", 3 * np.array(SQUARE) + (40, 0, 0), TWO, material="grey")
    eye = Camera("desk", look_at(np.array([0.0, 1.5, 0.01]), np.zeros(3)), 0.6)
    scene = Scene(
        [Mesh("floor", np.array(SQUARE) - (0.5, 0, 0.5), TWO, material="grey"), lawn],
        MATERIALS,
        unit="lux",
        cameras=[eye],
    )
    display = refine(scene, 0.5)
    light = np.where(display.points[:, 0] > 20, 1e5, 100.0)[:, None] * np.ones(3)
    result = Result(display.points, display.normals, light, 0.01 * light, np.ones(len(light)), "lux")
    outputs.write(tmp_path / "a.glb", outputs.Baked(result, scene, display))
    exposure = Reader(tmp_path / "a.glb").document.asset.extras["exposure"]
    shown = exposure * 100 * photopic(MATERIALS[0].reflectance[None])
    assert shown == pytest.approx(0.2, rel=0.02)  # a middle tone


def test_glb_keeps_the_cameras(tmp_path: Path):
    views = [
        Camera(name, look_at(np.array([2.0, 1.5, z]), np.zeros(3)), 0.7) for name, z in (("a", 1), ("b", 3))
    ]
    scene = Scene([Mesh("floor", SQUARE, TWO, material="grey")], MATERIALS, unit="lux", cameras=views)
    outputs.write(tmp_path / "a.glb", baked(scene))
    again = dl.load(tmp_path / "a.glb").cameras
    assert [camera.name for camera in again] == ["a", "b"]
    for camera, found in zip(views, again, strict=True):
        np.testing.assert_allclose(found.pose, camera.pose, atol=1e-6)
        assert found.vertical_fov == pytest.approx(0.7)


@pytest.mark.parametrize(("unit", "factor"), [("lux", 1), ("W/m2", 683)])
def test_glb_keeps_the_lights_where_they_are_now(tmp_path: Path, unit: str, factor: float):
    lights = [
        dl.PointLight("bulb", (1, 2, 3), (30, 20, 0), attached_to="cart"),
        dl.SpotLight("spot", (0, 2, 0), (0.3, -1, 0.2), (5, 10, 20), 0.2, 0.5),
        dl.SunLight("sun", (0, -1, 0), (3, 3, 3)),
        dl.PointLight("off", (0, 1, 0), (0, 0, 0)),
        dl.PointLight("gone", (0, 1, 0), (1, 1, 1), attached_to="taken away"),
    ]
    meshes = [
        Mesh("floor", SQUARE, TWO, material="grey"),
        Mesh("cart", SQUARE, TWO, material="grey", pose=shift(1, 0, 0), movable=True),
        Mesh("taken away", SQUARE, TWO, material="grey", movable=True),
    ]
    scene = Scene(meshes, MATERIALS, lights, unit=unit)
    outputs.write(tmp_path / "a.glb", baked(scene, poses={"cart": shift(1, 0, 5), "taken away": None}))
    bulb, spot, sun, off = dl.load(tmp_path / "a.glb").lights
    np.testing.assert_allclose(bulb.position, (2, 2, 8))  # attached lights are in the movable's own space
    np.testing.assert_allclose(bulb.intensity, factor * np.array([30, 20, 0]), rtol=1e-6)
    np.testing.assert_allclose(spot.position, (0, 2, 0))
    np.testing.assert_allclose(spot.direction, np.array([0.3, -1, 0.2]) / np.sqrt(1.13), atol=1e-6)
    np.testing.assert_allclose(spot.intensity, factor * np.array([5, 10, 20]), rtol=1e-6)
    assert (spot.inner_angle, spot.outer_angle) == pytest.approx((0.2, 0.5))
    np.testing.assert_allclose(sun.direction, (0, -1, 0), atol=1e-7)
    np.testing.assert_allclose(sun.irradiance, factor * np.array([3, 3, 3]))
    assert (off.intensity == 0).all()


def test_lights_of_movables_stay_where_they_were_loaded(tmp_path: Path):
    builder = GltfBuilder()
    inner = builder.node(
        root=False, name="bulb", translation=[0, 1, 0], extensions=builder.light(type="point")
    )
    builder.node(
        name="MOVE_lamp",
        mesh=builder.quad(),
        children=[inner],
        translation=[4, 5, 6],
        rotation=[0, 0.6, 0, 0.8],
    )
    scene = dl.load(builder.write(tmp_path, "lamp.glb"))
    for poses, place in (({}, (4, 6, 6)), ({"MOVE_lamp": shift(1, 0, 0)}, (1, 1, 0))):
        outputs.write(tmp_path / "a.glb", baked(scene, poses=poses))
        again = dl.load(tmp_path / "a.glb")
        (bulb,) = again.lights
        pose = again.mesh(bulb.attached_to).pose
        np.testing.assert_allclose(pose[:3, :3] @ bulb.position + pose[:3, 3], place, atol=1e-6)
