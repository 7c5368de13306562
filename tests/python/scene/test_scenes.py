# SPDX-License-Identifier: Apache-2.0
"""The generated demonstration scenes: deterministic, sound geometry, movables free to move."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import Mesh, Scene

SCENES = {name: getattr(dl.scenes, name) for name in ("office", "cornell_box", "expo", "atrium")}
TRIANGLES = {
    "office": (10_000, 20_000),
    "cornell_box": (50, 60),
    "expo": (10_000, 40_000),
    "atrium": (250_000, 320_000),
}
GROUPS = {
    "office": {"window row", "wall row", "desk lamp"},
    "cornell_box": {"ceiling"},
    "expo": {"panels", "spots", "exhibit spots", "wall washers"},
    "atrium": {"skylight", "ground lamps", "upper lamps"},
}
# Everything else is a closed solid with its front outside.
SHEETS = {
    "cornell_box": {"walls"},
    "office": {"room"},
    "expo": {"hall", "floor"},
    "atrium": {
        "outer_walls",
        "ground_floor",
        "upper_floor",
        "attic",
        "ground_vaults",
        "upper_vaults",
        "skylight",
    },
}
# What the docstrings promise: the movable's centre may be anywhere in x, z.
FREE_FLOOR = {
    ("office", "chair"): ((0.9, 3.0), (0.8, 2.4)),
    ("expo", "exhibit"): ((0.5, 4.5), (0.8, 3.4)),
    ("atrium", "trolley"): ((-10.0, 5.0), (-3.5, 3.5)),
}


@pytest.fixture(scope="module")
def scenes() -> dict[str, Scene]:
    return {name: make() for name, make in SCENES.items()}


@pytest.fixture(params=SCENES)
def named(request: pytest.FixtureRequest, scenes: dict[str, Scene]) -> tuple[str, Scene]:
    return request.param, scenes[request.param]


def corners(mesh: Mesh) -> np.ndarray:
    """(m, 3, 3) triangle corners in world space."""
    return mesh.world_vertices[mesh.triangles]


def volume(triangles: np.ndarray) -> float:
    a, b, c = triangles.transpose(1, 0, 2)
    return float((a * np.cross(b, c)).sum() / 6)


def is_closed(mesh: Mesh) -> bool:
    """Whether every edge is used exactly once in each direction."""
    t = mesh.triangles
    edges = np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]])
    forth = np.sort(edges[:, 0] * len(mesh.vertices) + edges[:, 1])
    back = np.sort(edges[:, 1] * len(mesh.vertices) + edges[:, 0])
    return len(np.unique(forth)) == len(forth) and bool((forth == back).all())


def winding(triangles: np.ndarray, point: np.ndarray) -> float:
    """How many closed solids contain the point (van Oosterom and Strackee 1983)."""
    a, b, c = (triangles - point).transpose(1, 0, 2)
    la, lb, lc = (np.linalg.norm(v, axis=1) for v in (a, b, c))
    above = (a * np.cross(b, c)).sum(axis=1)
    below = la * lb * lc + (a * b).sum(axis=1) * lc + (b * c).sum(axis=1) * la + (c * a).sum(axis=1) * lb
    return float(2 * np.arctan2(above, below).sum() / (4 * np.pi))


def crossings(starts: np.ndarray, ends: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """For each line segment, how many of the triangles it crosses (Möller and Trumbore 1997)."""
    found = np.zeros(len(starts), np.int64)
    e1, e2 = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    for i in range(0, len(starts), 128):
        origin = starts[i : i + 128, None]
        direction = ends[i : i + 128, None] - origin
        p = np.cross(direction, e2)
        determinant = (p * e1).sum(axis=2)
        parallel = np.abs(determinant) < 1e-14
        inverse = 1 / np.where(parallel, 1.0, determinant)
        s = origin - triangles[:, 0]
        q = np.cross(s, e1)
        u, v, t = (
            (s * p).sum(axis=2) * inverse,
            (direction * q).sum(axis=2) * inverse,
            (q * e2).sum(axis=2) * inverse,
        )
        hit = ~parallel & (u >= 0) & (v >= 0) & (u + v <= 1) & (t >= 0) & (t <= 1)
        found[i : i + 128] = hit.sum(axis=1)
    return found


def intersect(one: np.ndarray, other: np.ndarray) -> bool:
    """Whether any edge of one triangle soup crosses a triangle of the other."""
    low = np.maximum(one.min(axis=(0, 1)), other.min(axis=(0, 1)))
    high = np.minimum(one.max(axis=(0, 1)), other.max(axis=(0, 1)))
    near = [s[((s.min(axis=1) <= high) & (s.max(axis=1) >= low)).all(axis=1)] for s in (one, other)]
    if not all(map(len, near)):
        return False
    return any(
        crossings(a.reshape(-1, 3), np.roll(a, -1, axis=1).reshape(-1, 3), b).any()
        for a, b in (near, near[::-1])
    )


def static_triangles(scene: Scene, without: set[str]) -> np.ndarray:
    return np.concatenate([corners(m) for m in scene.meshes if m.name not in without])


def solids(scene: Scene, name: str, without: set[str]) -> np.ndarray:
    return static_triangles(scene, SHEETS[name] | without)


def clear_of_static(name: str, scene: Scene, mesh: Mesh) -> bool:
    """Whether the mesh neither touches nor lies within another one."""
    others = static_triangles(scene, {mesh.name})
    own = corners(mesh)
    return not intersect(own, others) and abs(winding(solids(scene, name, {mesh.name}), own[0, 0])) < 1e-3


def test_same_arrays_twice(named: tuple[str, Scene]) -> None:
    name, scene = named
    again = SCENES[name]()
    assert [m.name for m in again.meshes] == [m.name for m in scene.meshes]
    for one, two in zip(scene.meshes, again.meshes, strict=True):
        for key in ("vertices", "triangles", "material_index", "pose"):
            assert getattr(one, key).tobytes() == getattr(two, key).tobytes(), f"{one.name}: {key}"
        assert one.material == two.material
    for one, two in zip(scene.materials, again.materials, strict=True):
        assert (
            one.reflectance.tobytes() + one.emission.tobytes()
            == two.reflectance.tobytes() + two.emission.tobytes()
        )


def test_triangle_counts(named: tuple[str, Scene]) -> None:
    name, scene = named
    low, high = TRIANGLES[name]
    assert low <= sum(len(m.triangles) for m in scene.meshes) <= high


def test_names_units_and_groups(named: tuple[str, Scene]) -> None:
    name, scene = named
    assert scene.unit == ("W/m2" if name == "cornell_box" else "lux")
    assert set(scene.groups) == GROUPS[name]
    assert (
        scene.movable
        == {
            "office": ("chair", "desk_lamp"),
            "cornell_box": ("short_block", "tall_block"),
            "expo": ("exhibit",),
            "atrium": ("trolley",),
        }[name]
    )
    assert scene.cameras[0].name == "main"
    used = {material for mesh in scene.meshes for material in mesh.material}
    assert used == {m.name for m in scene.materials}, "no material lies unused"


def test_solids_are_closed_and_face_outwards(named: tuple[str, Scene]) -> None:
    name, scene = named
    for mesh in scene.meshes:
        if mesh.name in SHEETS[name]:
            assert not mesh.movable
            continue
        assert is_closed(mesh), mesh.name
        assert volume(mesh.vertices[mesh.triangles]) > 0, mesh.name


def test_no_degenerate_triangles_and_no_stray_vertices(named: tuple[str, Scene]) -> None:
    _, scene = named
    for mesh in scene.meshes:
        triangles = mesh.vertices[mesh.triangles]
        longest = np.linalg.norm(triangles - np.roll(triangles, 1, axis=1), axis=2).max(axis=1)
        assert (2 * mesh.triangle_areas() / longest).min() > 5e-5, (
            f"{mesh.name}: a triangle under 0.05 mm wide"
        )
        assert len(np.unique(mesh.triangles)) == len(mesh.vertices), mesh.name


def coincident_pairs(triangles: np.ndarray) -> np.ndarray:
    """(k, 2) pairs of triangles that lie in one plane (within 0.03 mm) and overlap by more than 0.2 mm."""
    normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    axis = np.abs(normal).argmax(axis=1)
    normal *= np.sign(np.take_along_axis(normal, axis[:, None], axis=1))
    offset = (triangles.mean(axis=1) * normal).sum(axis=1)
    rounded = np.round(normal * 20_000).astype(np.int64)
    key = (rounded[:, 0] * 100_003 + rounded[:, 1]) * 100_003 + rounded[:, 2]
    order = np.lexsort((offset, key))
    plane = np.zeros(len(key), np.int64)
    plane[order[1:]] = np.cumsum((np.diff(key[order]) != 0) | (np.diff(offset[order]) > 3e-5))

    # Along the axis nearest to its normal, each plane is seen flat; planes are kept apart in x.
    slack = 2e-4
    kept = np.array([(1, 2), (0, 2), (0, 1)])[axis]
    flat = np.take_along_axis(triangles, kept[:, None], axis=2)
    flat[:, :, 0] += 1000.0 * plane[:, None]
    order = np.argsort(flat[:, :, 0].min(axis=1), kind="stable")
    flat = flat[order]
    low, high = flat.min(axis=1) + slack, flat.max(axis=1) - slack
    last = np.searchsorted(low[:, 0], high[:, 0])
    number = np.maximum(last - np.arange(len(flat)) - 1, 0)
    first = np.repeat(np.arange(len(flat)), number)
    second = first + 1 + np.arange(len(first)) - np.repeat(np.cumsum(number) - number, number)
    near = (low[first, 1] < high[second, 1]) & (high[first, 1] > low[second, 1])
    first, second = first[near], second[near]
    apart = np.zeros(len(first), bool)
    for one, other in ((flat[first], flat[second]), (flat[second], flat[first])):
        for i in range(3):
            edge = one[:, (i + 1) % 3] - one[:, i]
            across = np.stack([-edge[:, 1], edge[:, 0]], axis=1)
            across /= np.maximum(np.linalg.norm(across, axis=1, keepdims=True), 1e-12)
            inside = (one[:, (i + 2) % 3] - one[:, i]) * across
            across *= np.sign(inside.sum(axis=1, keepdims=True))
            apart |= ((other - one[:, i : i + 1]) * across[:, None]).sum(axis=2).max(axis=1) < slack
    return np.stack([order[first[~apart]], order[second[~apart]]], axis=1)


def test_no_faces_coincide(named: tuple[str, Scene]) -> None:
    _, scene = named
    triangles = static_triangles(scene, set())
    owner = np.repeat([m.name for m in scene.meshes], [len(m.triangles) for m in scene.meshes])
    pairs = coincident_pairs(triangles)
    assert len(pairs) == 0, {(str(owner[a]), str(owner[b])) for a, b in pairs}


def test_coincident_faces_would_be_found() -> None:
    scene = dl.scenes.cornell_box()
    block = scene.mesh("tall_block")
    sunk = replace(block, name="copy", pose=block.pose + np.array([[0, 0, 0, 0.3], *[[0] * 4] * 3]))
    both = np.concatenate([corners(block), corners(sunk)])
    assert len(coincident_pairs(both)) > 0, "tops and bottoms overlap"


def test_movables_stand_clear(named: tuple[str, Scene]) -> None:
    name, scene = named
    for movable in scene.movable:
        mesh = scene.mesh(movable)
        assert clear_of_static(name, scene, mesh), movable
        pushed = replace(mesh, pose=mesh.pose + np.array([[0] * 4, [0, 0, 0, -0.01], *[[0] * 4] * 2]))
        assert not clear_of_static(name, scene, pushed), "1 cm lower it is in what it stands on"


@pytest.mark.parametrize(("name", "movable"), FREE_FLOOR)
def test_promised_floor_is_free(scenes: dict[str, Scene], name: str, movable: str) -> None:
    mesh = scenes[name].mesh(movable)
    for x, z in product(*(np.linspace(*span, 3) for span in FREE_FLOOR[name, movable])):
        pose = mesh.pose.copy()
        pose[[0, 2], 3] = x, z
        assert clear_of_static(name, scenes[name], replace(mesh, pose=pose)), f"x {x}, z {z}"


def test_cameras_stand_in_free_air_and_see_the_movables(named: tuple[str, Scene]) -> None:
    name, scene = named
    for camera in scene.cameras:
        eye = camera.pose[:3, 3]
        assert abs(winding(solids(scene, name, set()), eye)) < 1e-3, "not inside a solid"
        low, high = scene.bounds
        if name == "cornell_box":  # stands before the open front
            high = high + np.array([0, 0, 10])
        assert (eye > low).all() and (eye < high).all()
    camera = scene.cameras[0]
    eye = camera.pose[:3, 3]
    for movable in scene.movable:
        points = scene.mesh(movable).world_vertices
        points = points[:: max(1, len(points) // 64)]
        local = (points - eye) @ camera.pose[:3, :3]
        up = np.abs(local[:, 1] / local[:, 2]) < np.tan(camera.vertical_fov / 2)
        across = np.abs(local[:, 0] / local[:, 2]) < 1.5 * np.tan(camera.vertical_fov / 2)
        assert ((local[:, 2] < 0) & up & across).mean() > 0.95, f"{movable} is within a 3:2 picture"
        others = static_triangles(scene, {movable})
        low, high = np.minimum(points.min(axis=0), eye), np.maximum(points.max(axis=0), eye)
        others = others[((others.min(axis=1) <= high) & (others.max(axis=1) >= low)).all(axis=1)]
        assert (crossings(np.broadcast_to(eye, points.shape), points, others) == 0).mean() > 0.6, movable


def test_luminous_faces_look_down_from_the_ceiling(scenes: dict[str, Scene]) -> None:
    for name, prefix in (
        ("office", "luminaire"),
        ("expo", "panel_lamp"),
        ("cornell_box", "lamp"),
        ("atrium", "skylight"),
    ):
        scene = scenes[name]
        emissive = {m.name for m in scene.materials if m.emissive}
        found = 0
        for mesh in scene.meshes:
            lit = np.isin(np.array(mesh.material)[mesh.material_index], list(emissive))
            if mesh.name.startswith(prefix) and lit.any():
                a, b, c = corners(mesh)[lit].transpose(1, 0, 2)
                normal = np.cross(b - a, c - a)
                assert (normal[:, 1] < 0).all() and np.abs(normal[:, [0, 2]]).max() < 1e-9
                found += 1
        assert found == {"office": 6, "expo": 8, "cornell_box": 1, "atrium": 1}[name]


@pytest.mark.parametrize(
    ("name", "lumens"),
    [("office", 6 * 5200 + 420), ("expo", 8 * 9000), ("atrium", 16 * 2200)],
)
def test_lamps_give_the_lumens_they_should(scenes: dict[str, Scene], name: str, lumens: float) -> None:
    lamps = [
        light["power"]
        for light in scenes[name].info()["lights"]
        if light["kind"] == "area" and light["group"] != "skylight"
    ]
    assert sum(lamps) == pytest.approx(lumens, rel=1e-9)


def test_office_reflectances_are_plausible(scenes: dict[str, Scene]) -> None:
    by_name = {m.name: m.reflectance.mean() for m in scenes["office"].materials}
    assert 0.2 <= by_name["carpet"] <= 0.3
    assert 0.5 <= by_name["wall"] <= 0.7
    assert 0.75 <= by_name["ceiling"] <= 0.85


def static_count(scene: Scene) -> int:
    return sum(len(m.triangles) for m in scene.meshes if not m.movable)


@pytest.mark.parametrize("detail", [1.5, 2.0, 4.0, 10.0])
def test_atrium_detail_multiplies_static_triangles(scenes: dict[str, Scene], detail: float) -> None:
    plain, fine = scenes["atrium"], dl.scenes.atrium(detail)
    assert static_count(fine) / static_count(plain) == pytest.approx(detail, rel=0.1)
    for mesh in plain.meshes:
        if mesh.movable or mesh.name.startswith(("lantern", "skylight")):
            assert fine.mesh(mesh.name).vertices.tobytes() == mesh.vertices.tobytes(), mesh.name


@pytest.mark.parametrize("detail", [0.5, 2.3])
def test_atrium_stays_sound_at_other_details(detail: float) -> None:
    scene = dl.scenes.atrium(detail)
    test_solids_are_closed_and_face_outwards(("atrium", scene))
    test_no_degenerate_triangles_and_no_stray_vertices(("atrium", scene))


@pytest.mark.parametrize("share", [0.01, 0.03, 0.10])
def test_atrium_trolley_is_a_share_of_the_scene(share: float) -> None:
    scene = dl.scenes.atrium(trolley_size=share)
    trolley = scene.mesh("trolley")
    own = np.linalg.norm(np.ptp(trolley.vertices, axis=0))
    assert own / np.linalg.norm(np.ptp(scene.bounds, axis=0)) == pytest.approx(share, rel=1e-9)
    assert clear_of_static("atrium", scene, trolley)


def test_atrium_sun_comes_through_the_open_row() -> None:
    scene = dl.scenes.atrium(sun=True)
    assert set(scene.groups) == GROUPS["atrium"] | {"sun"}
    (sun,) = scene.lights
    others = static_triangles(scene, {"trolley"})
    above = np.array([[0.0, 0.0, -3.5]]) - 20 * sun.direction
    assert crossings(above, above + 19.9 * sun.direction, others)[0] == 0, "the beam reaches the floor"


def test_atrium_refuses_what_it_cannot_build() -> None:
    with pytest.raises(dl.OptionError, match=r"atrium: detail: found 0, expected 0\.5 to 100"):
        dl.scenes.atrium(0)
    with pytest.raises(dl.OptionError, match=r"atrium: trolley_size: found 0\.5, expected a share"):
        dl.scenes.atrium(trolley_size=0.5)
