# SPDX-License-Identifier: Apache-2.0
"""Every value that can be read after edits is that of a recompute and of a bake: values are compared.

The edits are of every kind, added meshes of all sizes, shapes and poses among them, which stand on floors on
their corners, reach into discs and each other, and light the room; the sessions count in discs or gather.
"""

from __future__ import annotations

from typing import NamedTuple

import deltalux as dl
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from rooms import box, room, samples_in, translation, turn
from thoroughness import examples

POINTS = np.random.default_rng(3).uniform((-1.9, 0, -1.4), (1.9, 0, 1.4), (40, 3))
UP = np.broadcast_to((0.0, 1.0, 0.0), POINTS.shape)
WEDGE = np.array([(0, 1, 2), (3, 5, 4), (0, 3, 4), (0, 4, 1), (1, 4, 5), (1, 5, 2), (2, 5, 3), (2, 3, 0)])


class Added(NamedTuple):
    """A mesh to be added."""

    shape: str
    size: tuple[float, float, float]
    turn: np.ndarray
    at: tuple[float, float]
    height: float | None  # of its lowest point; None: where it lies now
    material: str

    def mesh(self, name: str) -> dl.Mesh:
        if self.shape == "wedge":
            end = np.array([(0, 0, 0), (1, 0, 0.1), (0.2, 1, 0)])
            vertices = np.concatenate([end, end + np.array([0, 0.05, 1])]) * self.size
            triangles = WEDGE
        elif self.shape == "leaf":  # open, tilted, much longer than wide: its plane is badly known
            vertices = np.array([(0, 0, 0), (1, 0.3, 0), (0.5, 0.16, 0.002)]) * self.size
            triangles = np.array([(0, 1, 2)])
        else:
            vertices, triangles = box(self.size)
        pose = np.eye(4)
        pose[:3, :3] = self.turn
        pose[:3, 3] = (self.at[0], 1.0, self.at[1])
        if self.height is not None:
            pose[1, 3] = self.height - (vertices @ self.turn.T)[:, 1].min()
        return dl.Mesh(name, vertices, triangles, self.material, pose=pose, movable=True)


def rotation(numbers) -> np.ndarray:
    """The rotation of a quaternion of any length."""
    w, x, y, z = np.array(numbers) / np.linalg.norm(numbers)
    return np.array(
        [
            (1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)),
            (2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)),
            (2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)),
        ]
    )


ANGLES = st.tuples(*[st.floats(-1, 1)] * 4).filter(lambda q: np.linalg.norm(q) > 0.1)
ADDED = st.builds(
    Added,
    st.sampled_from(["box", "box", "wedge", "leaf"]),
    st.tuples(*[st.floats(0.05, 0.6)] * 3),
    st.one_of(st.just(np.eye(3)), ANGLES.map(rotation)),
    st.tuples(st.floats(-1, 1), st.floats(-0.6, 0.6)),
    st.sampled_from([None, 0.0, 0.0, 1e-4, 0.01]),
    st.sampled_from(["wall", "paint", "glow", "own glow"]),
)
PLACES = st.builds(
    lambda x, y, z, angle: translation(x, y, z) @ turn(angle),
    st.floats(-1.5, 1.5), st.floats(0.45, 1.5), st.floats(-1, 1), st.floats(-3.1, 3.1),
)  # fmt: skip
NAMES = st.sampled_from(["block", "lamp", "added 0", "added 1", "added 2"])
EDIT = st.one_of(
    st.tuples(st.just("add"), ADDED),
    st.tuples(st.just("add"), ADDED),
    st.tuples(st.just("move"), NAMES, PLACES),
    st.tuples(st.just("toggle"), NAMES),
    st.tuples(st.just("dim"), st.sampled_from(["ceiling", "desk", "added 1"]), st.floats(0, 2)),
    st.tuples(st.just("paint"), st.sampled_from(["wall", "paint"]), st.floats(0, 0.9)),
)
SEQUENCES = st.lists(st.lists(EDIT, min_size=1, max_size=3), min_size=1, max_size=3)


def apply(session: dl.Session, edit) -> None:
    kind, *values = edit
    if kind == "add":
        session.add(values[0].mesh(f"added {sum(name.startswith('added') for name in session.poses)}"))
    elif kind == "move" and values[0] in session.poses:
        session.move(*values)
    elif kind == "toggle" and values[0] in session.poses:
        (session.add if session.poses[values[0]] is None else session.remove)(values[0])
    elif kind == "dim" and values[0] in session.dim_factors:
        session.dim(*values)
    elif kind == "paint":
        session.set_reflectance(values[0], (values[1], 0.5 * values[1], 0.2))


def values_of(session: dl.Session, gathers: bool) -> dict[str, np.ndarray]:
    """All that can be read of the light."""
    found = {
        "irradiance": session.irradiance,
        "standard error": session.standard_error,
        "sums": session.sums,
        "at": session.at(POINTS, UP),
        "gradient": session.gradient,
    }
    if gathers:
        found |= {part: session.at(POINTS, UP, part=part) for part in ("direct", "indirect")}
    return found


OPTIONS = {
    "discs": {"gather": "off"},
    "discs by paths": {"gather": "off", "direct": "paths"},
    "discs by rays": {"gather": "off", "direct": "sampled", "segment_end": "bounded"},
    "gather": {"gather": 32},
    "gather by paths": {"gather": 16, "direct": "paths", "threads": 2},
}


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS)
@settings(max_examples=examples(40), suppress_health_check=[HealthCheck.too_slow])
@given(sequence=SEQUENCES)
def test_values_are_those_of_a_recompute_and_of_a_bake(options, sequence):
    """Those that are kept between readings, too: they are read before the last update."""
    scene, gathers = room(), options["gather"] != "off"
    points = dl.Samples(POINTS, (0, 1, 0), radius=0.3)
    samples = dl.Samples.concatenate([samples_in(scene), points])
    with dl.Session(scene, samples, paths=600, **({"threads": 1} | options)) as session:
        session.bake()
        for edits in sequence:
            for edit in edits:
                apply(session, edit)
            session.update()
            found, digest = values_of(session, gathers), session.digest()
        for again in (session.recompute, session.bake):
            again()
            for name, expected in values_of(session, gathers).items():
                np.testing.assert_array_equal(found[name], expected, err_msg=f"{name}, {again.__name__}")
            assert session.digest() == digest
