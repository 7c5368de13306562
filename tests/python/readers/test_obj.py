# SPDX-License-Identifier: Apache-2.0
"""OBJ and MTL: polygons, index forms, materials, objects, refusals."""

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png

SQUARE = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"


def load(tmp_path, text, mtl=None, **options):
    (tmp_path / "scene.obj").write_text(text)
    if mtl is not None:
        (tmp_path / "scene.mtl").write_text(mtl)
    return dl.load(tmp_path / "scene.obj", **options)


FACES = (
    "1 2 3 4",
    "1/1 2/1 3/1 4/1",
    "1//1 2//1 3//1 4//1",
    "1/1/1 2/1/1 3/1/1 4/1/1",
    "-4 -3 -2 -1",
    "1 2 \\\n 3 4",
)


@pytest.mark.parametrize("face", FACES)
def test_index_forms(tmp_path, face):
    scene = load(tmp_path, f"{SQUARE}vn 0 0 1\nvt 0 0\nf {face}  # a quad\n")
    (mesh,) = scene.meshes
    np.testing.assert_array_equal(mesh.triangles, [[0, 1, 2], [0, 2, 3]])
    assert scene.unit == "W/m2"
    assert mesh.triangle_areas().sum() == pytest.approx(1)


LONG = {
    "a continued statement": SQUARE + "vt 0 0 \\\n" * 400_000 + "\nf 1 2 3 4\n",
    "empty lines": "\n" * 400_000 + SQUARE + "f 1 2 3 4\n",
    "a library named often": "mtllib scene.mtl\n" * 10_000 + SQUARE + "f 1 2 3 4\n",
}


@pytest.mark.timeout(20)
@pytest.mark.parametrize("text", LONG.values(), ids=LONG)
def test_long_files_take_time_in_proportion(tmp_path, text):
    """Each took minutes when the time grew with the square of the length."""
    (mesh,) = load(tmp_path, text, "newmtl grey\nKd 0.5 0.5 0.5\n" * 2_000).meshes
    assert len(mesh.triangles) == 2


@pytest.mark.timeout(20)
def test_a_texture_of_many_materials_is_read_once(tmp_path):
    (tmp_path / "grey.png").write_bytes(png(np.full((4000, 4000), 99, np.uint8)))
    names = range(1000)
    mtl = "".join(f"newmtl m{i}\nKd 1 1 1\nmap_Kd grey.png\n" for i in names)
    text = "mtllib scene.mtl\n" + SQUARE + "".join(f"usemtl m{i}\nf 1 2 3\n" for i in names)
    scene = load(tmp_path, text, mtl)
    assert len({m.reflectance.tobytes() for m in scene.materials}) == 1


def star(corners, inner=0.5):
    """A star in a tilted plane, wound counter-clockwise about `normal`, with its area."""
    angle = 2 * np.pi * np.arange(corners) / corners
    radius = np.where(np.arange(corners) % 2, inner, 1.0)
    across, up = np.array((1, 0, 0)), np.array((0, 0.6, 0.8))
    points = 3 + radius[:, None] * (np.cos(angle)[:, None] * across + np.sin(angle)[:, None] * up)
    return points, np.cross(across, up), corners / 2 * inner * np.sin(2 * np.pi / corners)


def polygon_text(points):
    return "".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()) + (
        "f " + " ".join(str(i + 1) for i in range(len(points))) + "\n"
    )


@pytest.mark.parametrize("first", [0, 1, 3])
@pytest.mark.parametrize("corners", [4, 10, 1000])
def test_polygons_of_any_shape_are_covered_once(tmp_path, corners, first):
    """A fan covers a concave polygon several times: it gave a star of 1,000 corners 50 times its area."""
    points, normal, area = star(corners, 0.2 if corners == 4 else 0.5)
    scene = load(tmp_path, polygon_text(np.roll(points, first, axis=0)))
    (mesh,) = scene.meshes
    assert mesh.triangle_areas().sum() == pytest.approx(area, rel=1e-9)
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    assert (np.cross(b - a, c - a) @ normal > 0).all()
    assert not [w for w in scene.warnings if "cross" in w]
    assert set(mesh.triangles.ravel()) == set(range(corners))


def test_a_concave_quad_keeps_its_texture_in_place(tmp_path):
    (tmp_path / "wood.png").write_bytes(png(np.full((2, 2, 3), 255, np.uint8)))
    points = [(0, 0), (4, 0), (1, 1), (0, 4)]  # the third corner points inwards; u and v are x and y
    text = "".join(f"v {x} {y} 0\nvt {x} {y}\n" for x, y in points[1:] + points[:1])
    text = f"mtllib scene.mtl\n{text}usemtl wood\nf 1/1 2/2 3/3 4/4\n"
    (mesh,) = load(tmp_path, text, "newmtl wood\nmap_Kd wood.png\n").meshes
    assert mesh.triangle_areas().sum() == pytest.approx(4)
    expected = mesh.vertices[mesh.triangles][..., :2] * (1, -1) + (0, 1)
    np.testing.assert_allclose(mesh.coordinates, expected)


def test_convex_polygons_are_fans(tmp_path):
    points, _, _ = star(12, 1.0)
    (mesh,) = load(tmp_path, polygon_text(points)).meshes
    np.testing.assert_array_equal(mesh.triangles, [(0, i, i + 1) for i in range(1, 11)])


@pytest.mark.parametrize("order", [(0, 2, 1, 3), (0, 1, 3, 2)])
def test_a_polygon_that_crosses_itself_is_told(tmp_path, order):
    points = np.array([(0, 0, 0), (2, 0, 0), (1, 1, 0), (0, 1, 0)], float)[list(order)]
    scene = load(tmp_path, polygon_text(points))
    assert "polygons that cross themselves: what they cover is a guess (line 5)" in scene.warnings


def test_a_polygon_without_area_is_no_fault(tmp_path):
    scene = load(tmp_path, SQUARE + "f 1 2 3\nf 1 2 1 2 1\nf 1 1 1 1\n")
    assert scene.info()["area"] == pytest.approx(0.5)


def test_negative_indexes_count_from_the_vertices_read_so_far(tmp_path):
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 5\nv 1 0 5\nv 0 1 5\nf -3 -2 -1\n"
    (mesh,) = load(tmp_path, text).meshes
    np.testing.assert_array_equal(mesh.vertices[mesh.triangles][:, :, 2], [[0, 0, 0], [5, 5, 5]])


def test_materials(tmp_path):
    (tmp_path / "wood.png").write_bytes(png(np.full((2, 2, 3), 255, np.uint8)))
    mtl = """newmtl wood
Kd 0.5 0.4 0.3
map_Kd -s 2 2 2 wood.png
d 0.5
newmtl lamp
Kd 0 0 0
Ke 17 12 4
newmtl grey
Kd 0.25
"""
    faces = "usemtl wood\nf 1 2 3\nusemtl lamp\nf 1 3 4\nusemtl grey\nf 1 2 4\nusemtl lost\nf 2 3 4\n"
    scene = load(tmp_path, "mtllib scene.mtl\n" + SQUARE + faces, mtl)
    found = {m.name: m for m in scene.materials}
    np.testing.assert_allclose(found["wood"].reflectance, (0.5, 0.4, 0.3))
    np.testing.assert_allclose(found["lamp"].emission, (17, 12, 4))
    np.testing.assert_allclose(found["grey"].reflectance, (0.25,) * 3)
    np.testing.assert_allclose(found["lost"].reflectance, (0.8,) * 3)
    told = [w for w in scene.warnings if "without a material" in w]
    assert len(told) == 1
    assert "reflect 0.8" in told[0]
    assert "--reflectance R" in told[0]
    assert told[0].endswith("(lost)")
    again = load(tmp_path, "mtllib scene.mtl\n" + SQUARE + faces, mtl, reflectance=0.3)
    np.testing.assert_allclose(again.material("lost").reflectance, (0.3,) * 3)
    np.testing.assert_allclose(again.material("grey").reflectance, (0.25,) * 3)
    assert found["wood"].surface.coverage == pytest.approx(0.5)
    (mesh,) = scene.meshes
    assert [mesh.material[i] for i in mesh.material_index] == ["wood", "lamp", "grey", "lost"]


def test_objects_and_movables(tmp_path):
    text = SQUARE + "o floor\ng a\nf 1 2 3\no MOVE_box\nf 1 3 4\no floor\nf 1 2 4\no vase\nf 2 3 4\n"
    scene = load(tmp_path, text, movable=["vase"])
    assert [m.name for m in scene.meshes] == ["floor", "MOVE_box", "vase"]
    assert scene.movable == ("MOVE_box", "vase")
    assert len(scene.mesh("floor").triangles) == 2
    vase = scene.mesh("vase")
    np.testing.assert_array_equal(vase.pose[:3, 3], (0.5, 0.5, 0))
    corners = {tuple(p) for p in vase.world_vertices}
    assert corners == {(1, 0, 0), (1, 1, 0), (0, 1, 0)}
    with pytest.raises(dl.OptionError, match='movable "cat": found no such object, expected one of: floor'):
        load(tmp_path, text, movable=["cat"])


def test_groups_name_the_meshes_where_there_are_no_objects(tmp_path):
    scene = load(tmp_path, SQUARE + "g left\nf 1 2 3\ng right\nf 1 3 4\ng left\nf 1 2 4\n")
    assert [m.name for m in scene.meshes] == ["left", "right"]


def test_what_cannot_be_read_beside_is_a_warning(tmp_path):
    text = "mtllib gone.mtl\nmtllib ../out.mtl\n" + SQUARE + "usemtl a\nf 1 2 3\ncurv 1 2\n"
    (tmp_path.parent / "out.mtl").write_text("newmtl a\nKd 1 0 0\n")
    scene = load(tmp_path, text)
    text = "\n".join(scene.warnings)
    assert 'no file "gone.mtl"' in text
    assert "leads out of the file's folder" in text
    assert "statements that are not honoured (curv)" in text
    np.testing.assert_array_equal(scene.materials[0].reflectance, (0.8, 0.8, 0.8))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("f 1 2 5\n", r"scene\.obj: line 5: found vertex index 5, expected 1 to 4"),
        ("f 0 1 2\n", "line 5: found vertex index 0"),
        ("f -5 1 2\n", "line 5: found vertex index -5"),
        ("f 1 2\n", "line 5: found a face of 2 corners, expected at least 3"),
        ("f 1 2 x\n", "line 5: found 'x', expected a vertex index"),
        ("v 1 2\nf 1 2 3\n", "line 5: found '1 2', expected three coordinates"),
        ("v 1 2 nan\nf 1 2 3\n", "line 5: found '1 2 nan', expected finite"),
    ],
)
def test_malformed(tmp_path, text, message):
    with pytest.raises(dl.FormatError, match=message):
        load(tmp_path, SQUARE + text)


def test_malformed_mtl(tmp_path):
    with pytest.raises(dl.FormatError, match=r"scene\.mtl line 2: found '1 2', expected three numbers"):
        load(tmp_path, "mtllib scene.mtl\n" + SQUARE + "f 1 2 3\n", "newmtl a\nKd 1 2\n")


def test_no_faces(tmp_path):
    with pytest.raises(dl.SceneError, match="found no faces"):
        load(tmp_path, SQUARE)


def test_patterns_select_several_objects(tmp_path):
    text = SQUARE + "o chair 1\nf 1 2 3\no chair 2\nf 1 3 4\no table\nf 1 2 4\n"
    assert load(tmp_path, text, movable=["chair*"]).movable == ("chair 1", "chair 2")
    with pytest.raises(dl.OptionError, match=r"expected one of: chair 1.*; `deltalux info FILE --nodes`"):
        load(tmp_path, text, movable=["stool*"])


@pytest.mark.parametrize(
    ("statement", "told"),
    [("d 1.000000", False), ("Tr 0.0", False), ("d 0.4", True), ("Tr 0.6", True), ("d -halo 0.5", True)],
)
def test_only_what_lets_light_through_is_told(tmp_path, statement, told):
    """Programs write the dissolve of opaque materials as well."""
    text, mtl = f"mtllib scene.mtl\n{SQUARE}f 1 2 3\n", f"newmtl glass\n{statement}\n"
    scene = load(tmp_path, text, mtl, glass="opaque")
    assert any("windows let no daylight in (glass)" in w for w in scene.warnings) is told


def test_unit_and_upward_axis(tmp_path):
    text = "v 100 200 300\nv 200 200 300\nv 100 300 300\nv 100 200 500\no a\nf 1 2 3\no b\nf 1 2 4\n"
    scene = load(tmp_path, text, unit="cm", up="z", movable=["b"])
    np.testing.assert_allclose(scene.mesh("a").vertices, [(1, 3, -2), (2, 3, -2), (1, 3, -3)])
    np.testing.assert_allclose(scene.mesh("b").world_vertices, [(1, 3, -2), (2, 3, -2), (1, 5, -2)])
    np.testing.assert_allclose(scene.mesh("b").pose[:3, 3], (1.5, 4, -2))


@pytest.mark.parametrize(
    ("statement", "read"),
    [
        ("a.mtl b.mtl", "ab"),
        ("b.mtl a.mtl c d.mtl", "abc"),
        ("c d.mtl", "c"),
        ("c d.mtl a.mtl", "ac"),
        ("a.mtl gone.mtl b.mtl", "ab"),
        ("gone too.mtl a.mtl", "a"),
        ('"c d.mtl"', "c"),
        ("sub\\\\e.mtl a.mtl", "ae"),
        ("plain a.mtl", "ap"),
        ("../out.mtl a.mtl", "a"),
    ],
)
def test_a_statement_may_name_several_libraries(tmp_path, statement, read):
    """Names may contain spaces, and need no suffix; what is not there is told."""
    folder = tmp_path / "folder"
    (folder / "sub").mkdir(parents=True)
    names = {"a": "a.mtl", "b": "b.mtl", "c": "c d.mtl", "e": "sub/e.mtl", "p": "plain", "o": "../out.mtl"}
    for key, name in names.items():
        (folder / name).write_text(f"newmtl {key}\nKd 0.1 0.2 0.3\n")
    faces = "".join(f"usemtl {key}\nf 1 2 3\n" for key in names)
    scene = load(folder, f"mtllib {statement}\n{SQUARE}{faces}")
    found = {m.name for m in scene.materials if m.reflectance[0] == 0.1}
    assert found == set(read)
    told = "\n".join(w for w in scene.warnings if "MTL files that cannot be read" in w)
    for name in ("gone.mtl", "gone too.mtl", "../out.mtl"):
        assert (name in told) == (name in statement)
    assert {str(folder / names[key]) for key in read} <= set(scene.files)


@pytest.mark.timeout(20)
def test_a_statement_of_very_many_names_takes_time_in_proportion(tmp_path):
    scene = load(tmp_path, f"mtllib {' '.join(f'n{i}' for i in range(20_000))}\n{SQUARE}f 1 2 3\n")
    assert len(scene.meshes) == 1
