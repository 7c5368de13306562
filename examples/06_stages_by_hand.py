# SPDX-License-Identifier: Apache-2.0
"""Every stage on plain arrays: trace segments, estimate irradiance by two methods, compare exactly."""

import deltalux as dl
import numpy as np

scene = dl.scenes.cornell_box()
segments = dl.trace(scene, paths=20_000, seed=1)
print(f"{len(segments.length):,} segments, longest {segments.length.max():.2f} m")

low, high = scene.bounds
points = np.random.default_rng(1).uniform(low, high, (500, 3))
samples = dl.Samples(points, normals=np.tile([0.0, 1.0, 0.0], (500, 1)), radius=0.05 * (high - low).min())
slow = dl.estimate.brute_force(segments, samples)
fast = dl.estimate.disc_index(segments, samples)
assert np.array_equal(slow.sums, fast.sums)  # integers: equal, not close
print(f"both methods give the same sums; mean irradiance {fast.irradiance.mean():.4g} {scene.unit}")
