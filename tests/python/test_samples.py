# SPDX-License-Identifier: Apache-2.0
"""Numbers of samples: radii that no session could use are refused, normals of any length are directions."""

import re
import warnings

import deltalux as dl
import numpy as np
import pytest


@pytest.mark.parametrize("radius", [0.0, -1.0, 1e16, 1e300, np.inf, np.nan, [0.1, 1e300], [np.nan, -1.0]])
def test_radii_beyond_the_engine_s_are_refused(radius):
    wrong = radius if np.ndim(radius) == 0 else radius[1]
    text = f"samples: radius: found {wrong:g}, expected positive metres up to 1e+15"
    with pytest.raises(dl.OptionError, match=re.escape(text)):
        dl.Samples(np.zeros((2, 3)), (0, 1, 0), radius)


def test_the_largest_radius_and_automatic_ones_are_taken():
    samples = dl.Samples(np.zeros((2, 3)), (0, 1, 0), [1e15, np.nan])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dl.Session(dl.scenes.cornell_box(), samples, paths=10)


@pytest.mark.parametrize("length", [1e-320, 1e-200, 1.0, 3.0, 1e200, 1e308])
def test_normals_of_any_length_are_directions(length):
    given = np.array([(0.0, 0.6, 0.8), (-1.0, 0.0, 0.0)]) * length
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        samples = dl.Samples(np.zeros((2, 3)), given)
    assert samples.normals == pytest.approx(given / length, rel=1e-3 if length < 1e-300 else 1e-15)


def test_normals_of_ordinary_length_keep_their_bits():
    given = np.random.default_rng(3).normal(size=(1000, 3))
    samples = dl.Samples(np.zeros((1000, 3)), given)
    assert np.array_equal(samples.normals, given / np.linalg.norm(given, axis=1, keepdims=True))
