# SPDX-License-Identifier: Apache-2.0
"""Lamps that bring light groups of their own into a baked session."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from edit_sequences import equals_recompute
from rooms import box, room, samples_in, translation

PLACES = [translation(0.6, 1.2, -0.6), translation(-0.6, 1.1, 0.7), translation(1.2, 0.5, 0.9)]


def with_glow(scene: dl.Scene) -> dl.Scene:
    """With a second material that emits in no group: the light of each mesh is a group of its own."""
    other = dl.Material("other glow", (0.2,) * 3, emission=(4, 3, 5))
    return dl.scene.replace_scene(scene, materials=[*scene.materials, other])


def lamp(number: int = 0, material: str = "own glow") -> dl.Mesh:
    return dl.Mesh(f"new{number}", *box((0.2,) * 3), material, pose=PLACES[number], movable=True)


def made(options: dict, groups: int = 2) -> dl.Session:
    scene = with_glow(room(groups=groups))
    return dl.Session(scene, samples_in(scene), **{"paths": 600, "threads": 1, "gather": 32} | options)


def test_a_new_lamp_is_dimmed_apart():
    """Off, it leaves what was there, but for its body; dimmed, light is between."""
    with made({"paths": 20_000, "direct": "sampled"}) as session:
        session.bake()
        assert list(session.dim_factors) == ["desk", "ceiling"]
        session.add(lamp())
        assert session.dim_factors["new0"] == 1
        lights = []
        for factor in (0, 0.5, 1):
            session.dim("new0", factor)
            session.update()
            lights.append(session.irradiance)
        assert lights[2].sum() > 1.1 * lights[0].sum()
        np.testing.assert_allclose(lights[1], (lights[0] + lights[2]) / 2, rtol=1e-6, atol=1e-9)
        session.dim("ceiling", 0)
        session.dim("desk", 0)
        session.update()
        np.testing.assert_allclose(session.irradiance.sum(), (lights[2] - lights[0]).sum(), rtol=1e-6)


def test_it_is_dimmed_in_the_update_that_brings_it():
    with made({}) as session, made({}) as other:
        for own in (session, other):
            own.bake()
            own.add(lamp())
        other.update()
        for own in (session, other):
            own.dim("new0", 0.25)
            own.update()
        assert session.digest() == other.digest()
        equals_recompute(session)


def test_two_new_groups_in_one_mesh():
    own = with_glow(room())
    apart = dl.Material("other glow", (0.2,) * 3, emission=(4, 3, 5), group="apart")
    two = dl.scene.replace_scene(own, materials=[*own.materials[:-1], apart])
    with dl.Session(two, samples_in(two), paths=600, gather=16) as session:
        session.bake()
        index = np.arange(12) // 6
        mesh = dl.Mesh(
            "new", *box((0.2,) * 3), ("other glow", "own glow"), material_index=index, pose=PLACES[0],
            movable=True,
        )  # fmt: skip
        session.add(mesh)
        assert list(session.dim_factors)[2:] == ["new", "apart"]  # in the order of the materials
        session.dim("apart", 0)
        session.update()
        equals_recompute(session)


def test_the_eighth_group_joins_the_ninth():
    """Its paths then carry its dim factor, for which the shared sums have room up to 1.5."""
    with made({"direct": "paths"}, groups=8) as session:
        session.bake()
        eighth = list(session.dim_factors)[7]
        session.dim(eighth, 4)
        session.update()
        with pytest.raises(dl.OptionError, match=r'add "new0".*eight groups.*dim the eighth one first'):
            session.add(lamp())
        assert "new0" not in session.poses
        session.dim(eighth, 0.3)
        session.add(lamp())
        session.update()
        equals_recompute(session)
        with pytest.raises(dl.OptionError, match="factor above"):
            session.dim("new0", 2)


def test_into_a_dark_room():
    scene = with_glow(room())
    dark = dl.Scene([m for m in scene.meshes if m.name in ("walls", "block")], scene.materials)
    with dl.Session(dark, samples_in(dark), paths=4000, gather=16) as session:
        session.bake()
        assert not session.irradiance.any()
        for number in (0, 1):
            session.add(lamp(number))
        session.dim("new1", 0.5)
        session.update()
        assert session.irradiance.any()
        equals_recompute(session)


@pytest.mark.parametrize("direct", ["paths", "sampled"])
def test_files_keep_new_groups(tmp_path, direct):
    path = tmp_path / "room.dlx"
    with made({"direct": direct}, groups=3) as session:
        session.bake()
        session.add(lamp(0))
        session.update()
        session.add(lamp(1, "other glow"))
        session.dim("new0", 0.5)
        session.dim("bulb0", 0.25)
        session.update()
        session.save(path)
        with dl.Session.open(path) as other:
            assert other.dim_factors == session.dim_factors
            assert other.digest() == session.digest()
            for own in (session, other):
                own.dim("new1", 0.3)
                own.add(lamp(2))
                own.update()
            assert other.digest() == session.digest()
            equals_recompute(other)


def test_a_refused_lamp_leaves_no_group():
    with made({}) as session:
        session.bake()
        digest, factors = session.digest(), session.dim_factors
        outside = dl.Mesh("new0", *box((0.2,) * 3), "own glow", pose=translation(2e15, 0, 0), movable=True)
        with pytest.raises(dl.OptionError, match="beyond 1e15 m"):
            session.add(outside)
        assert session.dim_factors == factors
        session.update()
        assert session.digest() == digest


def test_a_group_may_be_added_with_old_ones():
    """A mesh whose light is of a known group brings none."""
    with made({}) as session:
        session.bake()
        session.add(lamp(0, "glow"))
        assert list(session.dim_factors) == ["desk", "ceiling"]
        session.update()
        equals_recompute(session)


def test_scenes_number_groups_of_lights_first():
    scene = with_glow(room(groups=4))
    assert scene.groups == ("desk", "bulb0", "bulb1", "ceiling")
    assert scene.with_mesh(lamp()).groups == (*scene.groups, "new0")
