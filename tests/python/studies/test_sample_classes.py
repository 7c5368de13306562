# SPDX-License-Identifier: Apache-2.0
"""Classes of samples in a scene whose areas and borders are known."""

from __future__ import annotations

import deltalux as dl
import numpy as np
from deltalux.studies.sample_classes import CLASSES, classify
from scenes_for_tests import quad

SIDE, SMALL, TINY = 4.0, 0.15, 0.02  # metres
HITS = 16_000  # on 16 m²: 50 of them need 0.05 m², a disc of 0.126 m


def test_surfaces_are_sorted_by_area_and_distance_to_their_border() -> None:
    plates = {
        "floor": quad((0, 0, 0), (0, 0, SIDE), (SIDE, 0, 0)),
        "small": quad((1, 1, 1), (0, 0, SMALL), (SMALL, 0, 0)),
        "tiny": quad((2, 1, 1), (0, 0, TINY), (TINY, 0, 0)),
    }
    meshes = [shape.mesh(name, "grey") for name, shape in plates.items()]
    scene = dl.Scene(meshes, [dl.Material("grey", (0.5,) * 3)])
    display = dl.Samples.on_vertices(scene, spacing=0.1, sides="front").display
    assert display is not None
    found = classify(scene, display, k=50, hits=HITS)
    assert np.isclose(found.gather_area, 50 / HITS * (SIDE**2 + SMALL**2 + TINY**2))

    x, _, z = display.points.T
    mesh = display.vertex_mesh
    border = np.minimum(np.minimum(x, SIDE - x), np.minimum(z, SIDE - z))
    expected = np.select(
        [mesh == 2, mesh == 1, border < found.gather_radius], ["very small", "small", "edge"], "inside"
    )
    clear = (mesh > 0) | (np.abs(border - found.gather_radius) > 1e-3)  # the border is points, not lines
    assert (np.array(CLASSES)[found.number] == expected)[clear].all()
    assert set(expected[clear]) == set(CLASSES)


def test_a_closed_smooth_surface_has_no_edge() -> None:
    ring = np.linspace(0, 2 * np.pi, 16, endpoint=False)
    round_ = np.stack([np.cos(ring), np.zeros(16), np.sin(ring)], axis=1)
    points = np.concatenate([round_, [(0, 1, 0), (0, -1, 0)]])
    upper = [(16, (i + 1) % 16, i) for i in range(16)]
    lower = [(17, i, (i + 1) % 16) for i in range(16)]
    ball = dl.Mesh("ball", points, upper + lower, material="grey", smooth_angle=180)
    scene = dl.Scene([ball], [dl.Material("grey", (0.5,) * 3)])
    display = dl.Samples.on_vertices(scene, spacing=0.3, sides="front").display
    assert display is not None
    assert (classify(scene, display, k=50, hits=HITS).number == 0).all()
