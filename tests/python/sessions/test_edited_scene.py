# SPDX-License-Identifier: Apache-2.0
"""The scene of a session file as its edits have made it: a bake of it has the light of the session."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene.editing import with_edits
from deltalux.stored.facts import edited_scene, file_facts
from rooms import room, samples_in, translation, turn


def powers(scene: dl.Scene) -> dict[str, float]:
    """Power of all lights by group."""
    found: dict[str, float] = {}
    for light in scene.info()["lights"]:
        found[light["group"]] = found.get(light["group"], 0.0) + light["power"]
    return found


def edited(tmp_path, *edits):
    """Session after edits, and the scene read from its file."""
    scene = room(3)
    session = dl.Session(scene, samples_in(scene), paths=60_000, gather=128, threads=2)
    session.bake()
    for name, *values in edits:
        getattr(session, name)(*values)
    session.update()
    session.save(tmp_path / "room.dlx")
    return session, edited_scene(tmp_path / "room.dlx")


def test_an_unedited_scene_is_the_one_that_was_baked(tmp_path):
    session, scene = edited(tmp_path)
    assert scene.info() == session.scene.info()
    assert [m.name for m in scene.materials] == [m.name for m in session.scene.materials]


def test_what_was_edited_is_so_from_the_start(tmp_path):
    pose = translation(-0.9, 0.4, 0.2) @ turn(0.4)
    session, scene = edited(
        tmp_path, ("move", "block", pose), ("dim", "ceiling", 0.25), ("dim", "bulb0", 0.0),
        ("dim", "desk", 1.5), ("set_reflectance", "paint", (0.7, 0.2, 0.1)),
    )  # fmt: skip
    assert scene.movable == session.scene.movable
    block = next(mesh for mesh in scene.meshes if mesh.name == "block")
    np.testing.assert_allclose(block.pose, pose, atol=1e-12)
    before, now = powers(session.scene), powers(scene)
    assert now == pytest.approx({"ceiling": 0.25 * before["ceiling"], "desk": 1.5 * before["desk"]})
    assert scene.material("paint").reflectance.tolist() == [0.7, 0.2, 0.1]


def test_a_bake_of_it_has_the_light_of_the_session(tmp_path):
    """Null hypothesis: same means. Over eight seeds each they are 0.7945 and 0.7944.

    The difference of two has a standard deviation of 0.0016, a fifth of what is allowed: false alarms below
    1e-6 if it is normal.
    """
    pose = translation(-0.3, 0.31, -0.6)
    session, scene = edited(
        tmp_path, ("move", "block", pose), ("dim", "ceiling", 0.25),
        ("move", "lamp", translation(1.2, 0.9, 0.4)), ("set_reflectance", "wall", (0.3, 0.6, 0.5)),
    )  # fmt: skip
    baked = dl.Session(scene, samples_in(scene), paths=60_000, gather=128, seed=2, threads=2)
    baked.bake()
    points = np.random.default_rng(1).uniform((-1.8, 0.1, -1.3), (1.8, 1.8, 1.3), (200, 3))
    old, new = (each.at(points, np.tile([0.0, 1.0, 0.0], (200, 1))).mean() for each in (session, baked))
    assert new == pytest.approx(old, rel=0.01)


def test_what_was_removed_is_gone_with_its_lights(tmp_path):
    _, scene = edited(tmp_path, ("remove", "lamp"))
    assert "lamp" not in [mesh.name for mesh in scene.meshes]
    assert set(powers(scene)) == {"ceiling", "bulb0"}


def test_a_material_of_two_groups_is_dimmed_on_one_mesh_alone(tmp_path):
    """Lamps of one material, each a group by its name."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], float)
    lamps = [
        dl.Mesh(n, corners + np.array((x, 1, 0)), [(0, 1, 2), (0, 2, 3)], "glow")
        for n, x in (("a", -2), ("b", 1))
    ]
    floor = dl.Mesh("floor", 6 * corners - 3 * np.array([1, 0, 1]), [(0, 2, 1), (0, 3, 2)], "wall")
    scene = dl.Scene([floor, *lamps], [dl.Material("wall"), dl.Material("glow", emission=(2, 2, 2))])
    with dl.Session(scene, dl.Samples([(0, 0, 0)], [(0, 1, 0)]), paths=1000) as session:
        session.bake()
        session.dim("b", 0.5)
        session.update()
        session.save(tmp_path / "lamps.dlx")
    before, now = powers(scene), powers(edited_scene(tmp_path / "lamps.dlx"))
    assert now == pytest.approx({"a": before["a"], "b": 0.5 * before["b"]})


def test_groups_of_nearly_equal_factors_keep_their_own(tmp_path):
    """Their materials may not share a name: lamps of one material at factors that print alike."""
    corners = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], float)
    lamps = [
        dl.Mesh(n, corners + np.array((x, 1, 0)), [(0, 1, 2), (0, 2, 3)], "glow")
        for n, x in (("a", -2), ("b", 1))
    ]
    scene = dl.Scene(lamps, [dl.Material("glow", emission=(2, 2, 2)), dl.Material("glow at 0.5")])
    factors = {"a": 0.5, "b": 0.5 + 1e-9}
    before = powers(scene)
    now = powers(with_edits(scene, {}, (), factors, {}))
    assert now == {name: pytest.approx(factors[name] * before[name], rel=1e-12) for name in factors}


def test_info_tells_both_of_what_was_moved_and_removed(tmp_path):
    edited(tmp_path, ("move", "block", translation(-0.9, 0.4, 0.2)), ("remove", "block"))
    edits = file_facts(tmp_path / "room.dlx")[0]["edits"]
    assert list(edits["moved"]) == edits["removed"] == ["block"]
