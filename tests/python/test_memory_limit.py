# SPDX-License-Identifier: Apache-2.0
"""The memory limit holds for updates as it does for bakes, and its refusals say what fits."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box, room, samples_in, translation

LIMIT = 40 << 20


@pytest.fixture
def session():
    scene = dl.Scene(
        [
            dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "wall"),
            dl.Mesh("box", *box((0.3, 0.3, 0.3)), "wall", pose=translation(0, 0.5, 0), movable=True),
        ],
        [dl.Material("wall", (0.2, 0.2, 0.2))],
        [dl.PointLight("bulb", (0, 1.8, 0), (1, 1, 1))],
    )
    samples = dl.Samples([(1, 0, 1)], [(0, 1, 0)], radius=0.2)
    with dl.Session(scene, samples, paths=100_000, memory_limit=LIMIT, threads=1) as made:
        made.bake()
        assert made.statistics["bytes"] < LIMIT
        yield made


def test_brighter_surfaces_are_refused_before_they_outgrow_it(session):
    before, light = session.digest(), session.irradiance
    session.set_reflectance("wall", (1, 1, 1))
    with pytest.raises(dl.OptionError, match=r"reflectance: memory: .* about \d+ MiB, the limit is 40 MiB"):
        session.update()
    np.testing.assert_array_equal(session.irradiance, light)
    assert session.statistics["bytes"] < LIMIT
    # The edit waits, as every edit that did not take effect, until the material is set again.
    session.set_reflectance("wall", (0.2, 0.2, 0.2))
    assert session.digest() == before
    session.set_reflectance("wall", (0.3, 0.3, 0.3))
    session.update()
    after = session.digest()
    assert after != before
    session.recompute()
    assert session.digest() == after


def test_what_fits_is_not_refused(session):
    session.set_reflectance("wall", (0.4, 0.4, 0.4))
    session.update()
    digest = session.digest()
    session.recompute()
    assert session.digest() == digest
    assert session.statistics["bytes"] < LIMIT


def test_memory_limit_tells_how_many_rays_fit_where_those_are_too_many():
    scene, limit = room(), 30 << 20
    session = dl.Session(scene, samples_in(scene), paths=4000, gather=4096, memory_limit=limit)
    with session, pytest.raises(dl.OptionError, match="rays of each sample") as refusal:
        session.bake()
    fits = int(str(refusal.value).split("about ")[-1].split(" rays")[0])
    assert 256 < fits < 4096
    with dl.Session(scene, samples_in(scene), paths=4000, gather=fits, memory_limit=limit) as session:
        session.bake()
        assert session.statistics["bytes"] < limit
