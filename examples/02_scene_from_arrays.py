# SPDX-License-Identifier: Apache-2.0
"""Build a scene from arrays, and compare one point with the closed form."""

import deltalux as dl
import numpy as np

corners = np.array([[-5.0, 0, -5], [-5, 0, 5], [5, 0, 5], [5, 0, -5]])
floor = dl.Mesh("floor", corners, [[0, 1, 2], [0, 2, 3]], material="grey")
lamp = dl.PointLight("bulb", position=(0, 2, 0), intensity=(100, 100, 100))
scene = dl.Scene(
    meshes=[floor], materials=[dl.Material("grey", reflectance=(0.5, 0.5, 0.5))], lights=[lamp], unit="lux"
)

below = dl.Samples(points=[[0, 0, 0], [2, 0, 0]], normals=[0, 1, 0])
with dl.Session(scene, below, paths=10_000) as session:
    session.bake()
    for point, value in zip(session.samples.points, session.irradiance[:, 1], strict=True):
        distance = np.linalg.norm(np.subtract((0, 2, 0), point))
        expected = 100 * 2 / distance**3  # intensity · cosine / distance²
        print(f"at x = {point[0]:g} m: {value:.3f} lux, by the inverse square law {expected:.3f} lux")
        assert abs(value / expected - 1) < 0.01
