# SPDX-License-Identifier: Apache-2.0
"""Sessions that gather, and whose lights all get shadow rays, hold no discs and lack nothing."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from rooms import box, room, samples_in, translation

OPTIONS = {"paths": 3000, "gather": 16}


@pytest.fixture
def session():
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.6)  # automatic radii
    with dl.Session(scene, samples, **OPTIONS) as own:
        own.bake()
        yield own


def sampled(session: dl.Session) -> list[bool]:
    return [light["sampled"] for light in session.statistics["lights"]]


def test_discs_are_made_when_asked_for(session, tmp_path):
    """They tell what discs of other sessions tell; neither the digest nor a file changes by it."""
    digest = session.digest()
    small = session.statistics["bytes"]
    assert all(sampled(session)) and not session.sums.any()
    assert session.plan.parts["static"].samples == 0
    with dl.Session(session.scene, session.samples, **OPTIONS | {"gather": "off"}) as discs:
        discs.bake()
        np.testing.assert_array_equal(session.radius, discs.radius)
        np.testing.assert_array_equal(session.gradient, discs.gradient)
    with dl.Session(session.scene, session.samples, **OPTIONS | {"direct": "paths"}) as discs:
        discs.bake()
        areas = session._session().areas()
        np.testing.assert_array_equal(areas, discs._session().areas())
        assert (areas > 0).all()
    assert session.statistics["bytes"] > small
    assert session.digest() == digest
    session.save(tmp_path / "asked.dlx")
    with dl.Session.open(tmp_path / "asked.dlx") as opened:
        assert opened.digest() == digest
        np.testing.assert_array_equal(opened.radius, session.radius)
        np.testing.assert_array_equal(opened.gradient, session.gradient)


def test_gradients_follow_edits(session, tmp_path):
    """The discs kept from the first gradient serve a later state, and the bits are those of new ones."""
    before = session.gradient
    session.move("block", translation(-0.6, 0.31, 0.6))
    session.remove("lamp")
    session.update()
    after = session.gradient
    assert (after != before).any()
    session.save(tmp_path / "moved.dlx")
    with dl.Session.open(tmp_path / "moved.dlx", threads=1) as opened:
        np.testing.assert_array_equal(opened.gradient, after)
    session.recompute()
    np.testing.assert_array_equal(session.gradient, after)
    session.bake()
    session.update()
    np.testing.assert_array_equal(session.gradient, after)


@pytest.mark.parametrize("direct", ["auto", "paths"])
def test_added_lamps_get_what_the_others_get(session, direct):
    """Shadow rays, unless direct light is to come from paths; there, discs count it."""
    with dl.Session(session.scene, session.samples, **OPTIONS | {"direct": direct}) as own:
        own.bake()
        own.add(dl.Mesh("cube", *box((0.1, 0.1, 0.1), (1.2, 1.5, -0.8)), "glow", movable=True))
        own.update()
        assert sampled(own) == [direct == "auto"] * len(sampled(own))
        assert own.sums.any() == (direct == "paths")
        updated = own.irradiance, own.digest()
        own.recompute()
        np.testing.assert_array_equal(own.irradiance, updated[0])
        assert own.digest() == updated[1]


def test_direct_light_of_an_added_lamp_has_no_noise(session):
    """Other paths, and other points on the lamps, give the same direct light."""
    direct = []
    for seed in (1, 2):
        with dl.Session(session.scene, session.samples, **OPTIONS, seed=seed) as own:
            own.bake()
            own.add(dl.Mesh("cube", *box((0.1, 0.1, 0.1), (1.2, 1.5, -0.8)), "glow", movable=True))
            own.update()
            direct.append(own._session().read_direct())
    lit = direct[0].sum(axis=1) > 1e-3 * direct[0].sum(axis=1).max()
    assert lit.mean() > 0.7
    np.testing.assert_allclose(direct[0][lit], direct[1][lit], rtol=0.05)


def test_a_lamp_that_is_far_brighter_leaves_what_was_there(session):
    """It has quanta of its own: without it, light has the bits of before; with it, those of a recompute."""
    blinding = dl.Material("blinding", (0, 0, 0), emission=(1e11, 1e11, 1e11), group="desk")
    scene = dl.scene.replace_scene(session.scene, materials=[*session.scene.materials, blinding])
    with dl.Session(scene, samples_in(scene), **OPTIONS) as own:
        own.bake()
        before = own.irradiance
        own.add(dl.Mesh("cube", *box((1e-5, 1e-5, 1e-5), (1.2, 1.5, -0.8)), "blinding", movable=True))
        own.update()
        bright = own.irradiance
        assert bright.mean() > 2 * before.mean()
        own.remove("cube")
        own.update()
        np.testing.assert_array_equal(own.irradiance, before)
        own.add("cube")
        own.update()
        np.testing.assert_array_equal(own.irradiance, bright)
        digest = own.digest()
        own.recompute()
        assert own.digest() == digest


@pytest.mark.parametrize("short", [False, True])
def test_an_update_drops_the_discs_of_gradients_where_memory_is_short(session, short):
    limit = int(1.5 * session.statistics["forecast_bytes"]) if short else 1 << 34
    with dl.Session(session.scene, session.samples, **OPTIONS, memory_limit=limit) as own:
        own.bake()
        own.dim("desk", 0.9)
        own.update()
        small = own.statistics["bytes"]
        assert (small > limit / 2) == short
        before = own.gradient
        assert own.statistics["bytes"] > small
        own.dim("desk", 0.9)
        own.update()
        assert (own.statistics["bytes"] == small) == short
        np.testing.assert_array_equal(own.gradient, before)


def test_shadow_rays_of_added_lamps_count_in_the_memory_limit():
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.1)
    cubes = [box((0.02, 0.02, 0.02), (0.05 * i, 1.5, 0.05 * k)) for i in range(8) for k in range(8)]
    points = np.concatenate([corners for corners, _ in cubes])
    triangles = np.concatenate([8 * i + triangles for i, (_, triangles) in enumerate(cubes)])
    lamps = dl.Mesh("cubes", points, triangles, "glow", movable=True)
    with dl.Session(scene, samples, paths=500, gather=8) as free:
        free.bake()
        before = free.statistics["bytes"]
        limit = int(1.1 * max(before, free.statistics["forecast_bytes"]))
        free.add(lamps)
        free.update()
        assert free.statistics["bytes"] > limit
    with dl.Session(scene, samples, paths=500, gather=8, memory_limit=limit) as own:
        own.bake()
        digest = own.digest()
        with pytest.raises(dl.OptionError, match=r'add "cubes": memory: .* MiB, the limit is \d+ MiB'):
            own.add(lamps)
        own.update()
        assert own.digest() == digest
