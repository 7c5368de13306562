# SPDX-License-Identifier: Apache-2.0
"""Samples, other places and pictures of one session tell of the same light, however many lamps there are."""

from __future__ import annotations

import dataclasses

import deltalux as dl
import numpy as np
import pytest
from scenes_for_tests import box, joined, quad

UP = (0.0, 1.0, 0.0)


def hall(columns: int, rows: int) -> dl.Scene:
    """Panels over shelves, 2.4 m apart, their power rising by a factor of 30 along the hall."""
    size = np.array((2.4 * columns, 4.0, 2.4 * rows))
    shell = box((0, 0, 0), size)
    shelves = []
    for x in np.arange(1.6, size[0] - 1, 2.1):
        body = box((x, 0, 0.9), (x + 0.45, 1.9, size[2] - 1.1))
        shelves.append(dataclasses.replace(body, triangles=body.triangles[:, ::-1]))
    meshes = [shell.mesh("shell", "wall"), joined(*shelves).mesh("shelves", "shelf")]
    materials = [dl.Material("wall", (0.6, 0.6, 0.6)), dl.Material("shelf", (0.3, 0.4, 0.5))]
    for i in range(columns):
        radiance = 10 * 30 ** (i / columns)
        materials.append(dl.Material(f"lamp{i}", (0, 0, 0), (radiance,) * 3))
        panels = [quad((2.4 * i + 0.9, 3.9, 2.4 * j + 0.7), (0.6, 0, 0), (0, 0, 0.9)) for j in range(rows)]
        meshes.append(joined(*panels).mesh(f"panels{i}", f"lamp{i}"))
    return dl.Scene(meshes, materials)


@pytest.mark.parametrize(("columns", "rows", "gather"), [(2, 2, 128), (6, 4, 64), (12, 6, 32)])
def test_samples_and_other_places(columns, rows, gather):
    """Of 250 places, at most 1 in 50 may differ by 3.5 claimed errors of both; 1 in 2,000 is expected."""
    scene = hall(columns, rows)
    rng = np.random.default_rng(columns)
    points = rng.uniform((0.2, 0.8, 0.2), (2.4 * columns - 0.2, 0.8, 2.4 * rows - 0.2), (250, 3))
    free = ~((points[:, 0] - 1.6) % 2.1 < 0.5) | (points[:, 2] < 0.8) | (points[:, 2] > 2.4 * rows - 1)
    samples = dl.Samples(points[free], np.tile(UP, (free.sum(), 1)))
    with dl.Session(scene, samples, paths=30_000, gather=gather) as session:
        session.bake()
        light, claimed = session.irradiance[:, 1], session.standard_error[:, 1]
        whole = session.at(samples.points, samples.normals)[:, 1]
        direct = session.at(samples.points, samples.normals, part="direct")[:, 1]
        by_need = session.at(samples.points, samples.normals, part="direct", by_need=True)[:, 1]
        indirect = session.at(samples.points, samples.normals, part="indirect")[:, 1]
    assert (claimed > 0).all()
    assert np.mean(np.abs(whole - light) > 3.5 * np.sqrt(2) * claimed) < 0.02
    assert whole.mean() == pytest.approx(light.mean(), rel=0.01)
    np.testing.assert_allclose(direct + indirect, whole, rtol=1e-6)
    assert np.abs(by_need - direct).mean() < 0.005 * light.mean()
    # The direct part is that of all lamps, by whichever way each was counted in the samples.
    assert (light > 0.9 * direct - 4 * claimed).all()
