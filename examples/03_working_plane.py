# SPDX-License-Identifier: Apache-2.0
"""Minimum, mean and uniformity on a plane in the office, with its standard error."""

import deltalux as dl

scene = dl.scenes.office()
# The normal is u × v: up. At 1.3 m nothing stands in the plane.
plane = dl.Samples.on_grid(origin=(-1.5, 1.3, 1.0), u=(3, 0, 0), v=(0, 0, -2), spacing=0.2)
with dl.Session(scene, plane, paths=200_000) as session:
    session.bake()
    lux = session.irradiance @ (0.2126, 0.7152, 0.0722)
    error = session.standard_error @ (0.2126, 0.7152, 0.0722)
    print(f"{len(lux)} points: min {lux.min():.0f}, mean {lux.mean():.0f}, max {lux.max():.0f} lux")
    print(f"uniformity {lux.min() / lux.mean():.2f}, standard error {error.mean() / lux.mean():.1%}")
    for row in lux.reshape(plane.grid_shape)[::2]:
        print(" ".join(f"{value:5.0f}" for value in row))
    assert lux.min() > 0
