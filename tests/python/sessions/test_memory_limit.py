# SPDX-License-Identifier: Apache-2.0
"""The memory limit holds for updates as it does for bakes, and its refusals say what fits."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box, room, samples_in, translation
from session_files import rewrite

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


def test_what_outgrows_it_unforeseen_waits_and_can_be_taken_back():
    """A bulb in a black shade: without that every path goes on and on."""
    scene = dl.Scene(
        [
            dl.Mesh("walls", *box((4, 2, 3), (0, 1, 0), inward=True), "wall"),
            dl.Mesh(
                "shade", *box((0.4, 0.4, 0.4), inward=True), "black", pose=translation(0, 1, 0), movable=True
            ),
        ],
        [dl.Material("wall", (0.95,) * 3), dl.Material("black", (0, 0, 0))],
        [dl.PointLight("bulb", (0, 1, 0), (1, 1, 1))],
    )
    samples = dl.Samples([(1, 0, 1)], [(0, 1, 0)], radius=0.2)
    with dl.Session(scene, samples, paths=100_000, memory_limit=LIMIT, gather="off") as session:
        session.bake()
        before = session.digest()
        session.remove("shade")
        with pytest.raises(dl.OptionError, match=r"its limit of 40 MiB; \d+ paths wait as they were"):
            session.update()
        assert session.unfinished
        assert session.statistics["bytes"] < 1.1 * LIMIT
        session.add("shade")
        session.update()
        assert not session.unfinished
        assert session.digest() == before
        session.recompute()
        assert session.digest() == before


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


def test_rays_of_a_file_keep_to_it(tmp_path):
    """Before memory is taken for them."""
    scene, path = room(), tmp_path / "a.dlx"
    with dl.Session(scene, samples_in(scene), paths=1000, gather=64) as session:
        session.bake()
        session.save(path)
    rewrite(path, index=lambda index: index["options"].update(memory_limit=1))
    with pytest.raises(dl.FormatError, match=r"rays would need about \d+ MiB, the limit is 0 MiB; raise"):
        dl.Session.open(path)
