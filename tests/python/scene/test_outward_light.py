# SPDX-License-Identifier: Apache-2.0
"""Power of two-sided luminous surfaces: what leaves their body, by closed forms."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.cli.commands.node_list import node_facts
from deltalux.scene.outward_light import inner_shares

RADIANCE = 50.0


def tube(rings: int, sides: int, profile) -> tuple[np.ndarray, np.ndarray]:
    """A surface of revolution about +Y: `profile` gives radius and height for 0 to 1; no caps."""
    angle = 2 * np.pi * np.arange(sides) / sides
    radius, height = profile(np.linspace(0, 1, rings + 1))
    x, z = np.cos(angle), np.sin(angle)
    points = np.stack(
        [np.outer(radius, x), np.repeat(height[:, None], sides, 1), np.outer(radius, z)], axis=-1
    )
    a = np.arange(rings)[:, None] * sides + np.arange(sides)
    b = np.arange(rings)[:, None] * sides + (np.arange(sides) + 1) % sides
    quads = np.stack([a, a + sides, b, b, a + sides, b + sides], axis=-1).reshape(-1, 3)
    return points.reshape(-1, 3), quads


def ball(rings: int, cut: float = 1.0):
    """A unit ball, or of each meridian the share `cut` from the top."""
    return tube(rings, 2 * rings, lambda t: (np.sin(np.pi * cut * t), np.cos(np.pi * cut * t)))


def placed(part, seed: int, soup: bool = False):
    """Anywhere, of any size, with triangles in any order, windings as they come and unshared vertices."""
    rng = np.random.default_rng(seed)
    vertices, triangles = part
    q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    vertices = vertices * 10 ** rng.uniform(-2, 1) @ q + rng.uniform(-20, 20, 3)
    if soup:
        vertices, triangles = vertices[triangles].reshape(-1, 3), np.arange(3 * len(triangles)).reshape(-1, 3)
    triangles = rng.permutation(triangles)
    return vertices, triangles


def lamp(part, two_sided: bool, **fields) -> dl.Scene:
    material = dl.Material("lamp", (0.5,) * 3, (RADIANCE,) * 3, two_sided=two_sided)
    return dl.Scene([dl.Mesh("lamp", *part, material="lamp", **fields)], [material], unit="lux")


def sides(scene: dl.Scene) -> float:
    """Luminous sides by which `info` multiplies the area."""
    (light,) = scene.info()["lights"]
    return light["power"] / (np.pi * RADIANCE * light["area"])


@pytest.mark.parametrize("soup", [False, True])
@pytest.mark.parametrize("rings", [3, 8, 17])
def test_a_closed_ball_shines_outwards_only(rings: int, soup: bool):
    assert sides(lamp(placed(ball(rings), rings, soup), True)) == pytest.approx(1, abs=1e-6)
    assert sides(lamp(placed(ball(rings), rings, soup), False)) == pytest.approx(1)


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_a_flat_panel_shines_to_both_sides(seed: int):
    disc = tube(3, 12, lambda t: (0.1 + t, 0 * t))  # with a hole
    assert sides(lamp(placed(disc, seed), True)) == pytest.approx(2)
    quad = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 2], [0, 0, 2]]), np.array([[0, 1, 2], [0, 2, 3]])
    assert sides(lamp(placed(quad, seed), True)) == pytest.approx(2)
    assert sides(lamp(placed(quad, seed, soup=True), False)) == pytest.approx(1)


def test_what_leaves_by_holes_is_their_area():
    """A hemisphere: two thirds of 3 pi; a tube open at both ends; a bulb with a neck."""
    assert sides(lamp(placed(ball(40, 0.5), 1), True)) == pytest.approx(1.5, abs=0.01)
    shade = tube(4, 64, lambda t: (0 * t + 1, 3 * t))
    assert sides(lamp(placed(shade, 2), True)) == pytest.approx(1 + 2 * np.pi / (2 * np.pi * 3), abs=0.01)
    bulb = ball(40, 0.95)
    neck = np.sin(0.95 * np.pi) ** 2 / (2 * (1 - np.cos(0.95 * np.pi)))
    assert sides(lamp(placed(bulb, 3), True)) == pytest.approx(1 + neck, abs=0.002)


def test_bodies_that_are_joined_in_one_mesh_count_each_by_itself():
    (a, one), (b, two) = ball(6), (np.array([[9, 0, 0], [10, 0, 0], [9, 1, 0.0]]), np.array([[0, 1, 2]]))
    vertices, triangles = np.concatenate([a, b]), np.concatenate([one, two + len(a)])
    shares = inner_shares(vertices, triangles)
    np.testing.assert_allclose(shares[:-1], 0, atol=1e-6)
    assert shares[-1] == pytest.approx(1)


def test_a_bulb_is_closed_by_its_socket():
    """Only a part of the closed body is luminous."""
    vertices, triangles = ball(8)
    index = (vertices[triangles].mean(axis=1)[:, 1] < 0).astype(int)
    materials = [
        dl.Material("glass", emission=(RADIANCE,) * 3, two_sided=True),
        dl.Material("socket"),
    ]
    mesh = dl.Mesh("bulb", vertices, triangles, ("glass", "socket"), index)
    assert sides(dl.Scene([mesh], materials, unit="lux")) == pytest.approx(1, abs=1e-6)


def test_slivers_and_empty_triangles_are_no_holes():
    vertices, triangles = ball(8)
    triangles = np.concatenate([triangles, [[0, 0, 5], [3, 3, 3]]])
    assert sides(lamp((vertices, triangles), True)) == pytest.approx(1, abs=1e-6)


def test_the_list_of_nodes_says_the_same(tmp_path):
    scene = lamp(placed(ball(8), 5), True)
    scene = dl.Scene(
        scene.meshes, scene.materials, unit="lux",
        nodes=[dl.scene.Node("lamp", -1, np.eye(4), (("lamp", 0, len(scene.meshes[0].triangles)),))],
    )  # fmt: skip
    (node,) = node_facts(scene)
    assert node["lights"][0]["power"] == pytest.approx(scene.info()["lights"][0]["power"])
