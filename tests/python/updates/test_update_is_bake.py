# SPDX-License-Identifier: Apache-2.0
"""After any edits, an update has the bits of a bake, in random rooms where all that a bake chooses matters.

Narrow spots and the sun make beams and guides, slits and pools other numbers of rays; lamps stand on
movables, and a board covers a hole behind which there is more light. Some rooms have no sun, or no spots:
chains ask lamps again then that moved, and are not cast again. Half of the rooms have textures; in a third,
the board and a case are glass, or cover only a part of their area.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import png
from deltalux.scene import replace_scene
from deltalux.scene.look import ALPHA_MODES, WRAPS, Look, Texture
from deltalux.session import ranges
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rooms import box, translation, turn
from shared_sessions import Shared
from thoroughness import examples

MATERIALS = [
    dl.Material("white", (0.8, 0.78, 0.75)),
    dl.Material("wood", (0.5, 0.35, 0.2)),
    dl.Material("glow", (0, 0, 0), (6, 5, 4)),
]
PATHS = 4000


def movable(name: str, size: tuple[float, float, float], pose: np.ndarray) -> dl.Mesh:
    return dl.Mesh(name, *box(size), "wood", pose=pose, movable=True)


def random_room(seed: int) -> dl.Scene:
    """A room with a hole in its roof; its size, furniture and lamps depend on the seed."""
    rng = np.random.default_rng(seed)
    x, y, z = rng.uniform((1.5, 2.2, 1.2), (4, 3.5, 3))
    vertices, triangles = box((2 * x, y, 2 * z), (0, y / 2, 0), inward=True)
    roof = vertices[triangles][:, :, 1].min(axis=1) > y - 1e-9
    hole = rng.uniform(0.2, 0.5)
    corners = np.array([(-x, y, -z), (x, y, -z), (x, y, z), (-x, y, z)])
    rim = np.concatenate([corners, corners * (hole, 1, hole)])
    ring = [t for i in range(4) for j in [(i + 1) % 4] for t in ((i, j, 4 + j), (i, 4 + j, 4 + i))]
    meshes = [
        dl.Mesh("walls", vertices, triangles[~roof], "white"),
        dl.Mesh("roof", rim, ring, "white"),
        dl.Mesh("panel", *box((0.5, 0.02, 0.3)), "glow", pose=translation(-0.6 * x, y - 0.05, 0)),
        movable("board", (2.2 * hole * x, 0.03, 2.2 * hole * z), translation(0, y + 0.02, 0)),
        movable("stand", (0.1, 0.5, 0.1), translation(0.5, 0.26, 0.4)),
        dl.Mesh("lantern", *box((0.2, 0.1, 0.15)), "glow", pose=translation(-0.5, 0.7, -0.3), movable=True),
    ]
    for k in range(3):
        size = rng.uniform(0.1, 0.7, 3)
        at = translation(rng.uniform(-0.7, 0.7) * x, size[1] / 2 + 0.003, rng.uniform(-0.7, 0.7) * z)
        pose = at @ turn(rng.uniform(0, 3))
        meshes.append(dl.Mesh(f"case {k}", *box(size), "wood", pose=pose, movable=k == 0))
    sunny, has_spots = (int(n) for n in rng.random(2) < 0.7)
    lights: list = [dl.SunLight("sun", rng.uniform((-1, -2, -1), (1, -1, 1)), (30, 29, 26))][:sunny]
    for k in range(2 * has_spots):
        at = (rng.uniform(-0.6, 0.6) * x, y - 0.1, rng.uniform(-0.6, 0.6) * z)
        down = (rng.uniform(-0.3, 0.3), -1, 0.1)
        lights.append(dl.SpotLight(f"spot {k}", at, down, (80, 75, 70), 0.05, 0.15))
    aside = ((0, 0.3, 0), (0.2, -1, 0.3))
    angles = (0.1, 0.4) if has_spots else (0.9, 1.2)
    lights.append(dl.SpotLight("lamp", *aside, (20, 18, 15), *angles, attached_to="stand"))
    scene = dl.Scene(meshes, MATERIALS, lights)
    scene = textured(scene, rng) if rng.random() < 0.5 else scene
    return glazed(scene, rng) if rng.random() < 0.35 else scene


def textured(scene: dl.Scene, rng: np.random.Generator) -> dl.Scene:
    """The scene with random texels on walls, furniture and lamps; some triangles have no coordinates."""
    materials = []
    for material in scene.materials:
        texels = rng.integers(0, 256, (*rng.integers(1, 9, 2), 4), dtype=np.uint8)
        wrap = (int(rng.choice(WRAPS)), int(rng.choice(WRAPS)))
        texture = Texture(png(texels), rng.uniform(0.1, 0.6, 3), wrap)
        look = Look(texture, alpha_mode=str(rng.choice(ALPHA_MODES)))
        if material.emissive:
            look = Look(glow=texture) if rng.random() < 0.5 else Look()
        materials.append(replace(material, look=look))
    meshes = []
    for mesh in scene.meshes:
        places = rng.uniform(-2, 2, (len(mesh.triangles), 3, 2)).astype(np.float32)
        places[rng.random(len(places)) < 0.1] = np.nan
        meshes.append(replace(mesh, coordinates=places))
    return replace_scene(scene, materials=materials, meshes=meshes)


def glazed(scene: dl.Scene, rng: np.random.Generator) -> dl.Scene:
    """The scene with a board and a case of a random pane, which may be textured."""
    coverage, transmission, inner, tint = rng.random(4) ** 0.5
    if rng.random() < 0.5:
        coverage, transmission = rng.choice([(1, 1), (coverage, 0), (1, transmission)])
    index = rng.choice([1, 1.5])
    surface = dl.PaneSurface(coverage, transmission, index, rng.choice([1, 2]), inner, tint)
    materials = [*scene.materials, replace(scene.materials[1], name="glass", surface=surface)]
    glass = [replace(m, material="glass") if m.name in ("board", "case 0") else m for m in scene.meshes]
    return replace_scene(scene, materials=materials, meshes=glass)


NAMES = st.sampled_from(["board", "case 0", "stand", "lantern"])
GROUPS = st.sampled_from(["sun", "spot 0", "lamp", "panel", "lantern"])
SHIFTS = st.tuples(*[st.floats(-0.4, 0.4)] * 3)
EDIT = st.one_of(
    st.tuples(st.just("move"), NAMES, SHIFTS, st.floats(-3, 3)),
    st.tuples(st.just("move"), NAMES, SHIFTS, st.floats(-3, 3)),
    st.tuples(st.just("toggle"), NAMES),
    st.tuples(st.just("dim"), GROUPS, st.sampled_from([0.0, 0.2, 3.0])),
    st.tuples(st.just("paint"), st.sampled_from(["white", "wood"]), st.floats(0, 0.9)),
)
SEQUENCES = st.lists(st.lists(EDIT, min_size=1, max_size=3), min_size=1, max_size=3)


def apply(session: dl.Session, edit) -> bool:
    """Whether the session takes the edit."""
    kind, name, *values = edit
    if kind == "move" and session.poses[name] is not None:
        by, angle = values
        pose = session.pose(name) @ turn(angle)
        pose[:3, 3] = np.clip(pose[:3, 3] + by, (-0.9, 0.1, -0.7), (0.9, 5, 0.7))
        try:
            session.move(name, pose)
        except dl.OptionError as error:
            # Outside are places that the sun's paths do not reach, and that other sessions' do not know.
            assert "sun" in str(error) or "leave the box" in str(error)
            return False
    elif kind == "toggle":
        (session.add if session.poses[name] is None else session.remove)(name)
    elif kind == "dim" and name in session.scene.groups:
        session.dim(name, values[0])
    elif kind == "paint":
        session.set_reflectance(name, (values[0], 0.5 * values[0], 0.2))
    return True


def values_of(session: dl.Session) -> dict[str, np.ndarray]:
    return {"irradiance": session.irradiance, "standard error": session.standard_error, "sums": session.sums}


def same(found: dict[str, np.ndarray], expected: dict[str, np.ndarray]) -> None:
    for name, value in expected.items():
        np.testing.assert_array_equal(found[name], value, err_msg=name)


OPTIONS = {"gather": {"gather": 64}, "discs": {"gather": "off"}}


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@settings(max_examples=examples(50), suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 10_000), sequence=SEQUENCES)
def test_an_update_has_the_bits_of_a_bake(options, seed, sequence):
    """Of a session that is baked after the edits, with two threads; and of the same session."""
    scene = random_room(seed)
    samples = dl.Samples.on_vertices(scene, spacing=0.7)
    options = {"paths": PATHS, "seed": seed} | options
    with (
        dl.Session(scene, samples, threads=1, **options) as updated,
        dl.Session(scene, samples, threads=2, **options) as baked,
    ):
        updated.bake()
        for edits in sequence:
            for edit in edits:
                for session in (updated, baked):
                    apply(session, edit)
            updated.update()
        baked.bake()
        same(values_of(updated), values_of(baked))
        assert updated.digest() == baked.digest()
        updated.bake()
        same(values_of(updated), values_of(baked))


@settings(max_examples=examples(20), suppress_health_check=[HealthCheck.too_slow])
@given(seed=st.integers(0, 10_000), sequence=SEQUENCES)
def test_opened_files_and_shared_bakes_have_the_same_bits(tmp_path_factory, seed, sequence):
    """A session that is saved and opened between edits, and four that share a bake after them."""
    scene = random_room(seed)
    samples, options = dl.Samples.on_vertices(scene, spacing=0.7), {"paths": PATHS, "gather": 64}
    file = tmp_path_factory.mktemp("opened") / "room.dlx"
    session = dl.Session(scene, samples, **options)
    session.bake()
    with Shared(scene, samples, ranges.ranges_of(PATHS, 4), **options) as shared:
        for edits in sequence:
            for edit in edits:
                if not apply(shared.whole, edit):  # out of the box that parts are baked for
                    continue
                for own in (session, *shared.parts):
                    apply(own, edit)
            session.update()
            session.save(file)
            session.close()
            session = dl.Session.open(file)
        shared.bake()
        shared.equals(session)
    found = values_of(session)
    session.bake()
    same(found, values_of(session))
    session.close()


def moved(scene: dl.Scene, name: str, change: Callable[[np.ndarray], np.ndarray]) -> dl.Scene:
    """The scene in a file in which this movable stands elsewhere."""
    meshes = [dl.Mesh(m.name, m.vertices, m.triangles, m.material, material_index=m.material_index,
                      pose=change(m.pose) if m.name == name else m.pose, movable=m.movable)
              for m in scene.meshes]  # fmt: skip
    return dl.Scene(meshes, scene.materials, scene.lights)


@pytest.mark.parametrize("seed", [3, 11, 12])
def test_an_update_has_the_bits_of_a_bake_of_the_edited_file(seed):
    """Of a scene in which an object that carries no lamp stands elsewhere from the start."""
    scene = random_room(seed)
    pose = translation(0.2, 0.4, -0.3) @ turn(0.7)
    samples = dl.Samples.on_vertices(scene, spacing=0.7)
    options = {"paths": PATHS, "gather": 64}
    with (
        dl.Session(scene, samples, **options) as session,
        dl.Session(moved(scene, "case 0", lambda _: pose), samples, **options) as other,
    ):
        session.bake()
        session.move("case 0", pose)
        session.update()
        other.bake()
        same(values_of(session), values_of(other))
