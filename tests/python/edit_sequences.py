# SPDX-License-Identifier: Apache-2.0
"""Random sequences of edits of the room of `rooms`, and what must hold after each."""

from __future__ import annotations

import deltalux as dl
import numpy as np
from hypothesis import strategies as st
from rooms import box, translation, turn


def poses(draw_float, clearance=0.45):
    """Poses that keep the movables inside the room."""
    return st.builds(
        lambda x, y, z, angle: translation(x, y, z) @ turn(angle),
        draw_float(-2 + clearance, 2 - clearance),
        draw_float(clearance, 2 - clearance),
        draw_float(-1.5 + clearance, 1.5 - clearance),
        draw_float(-3.1, 3.1),
    )


def _floats(low, high):
    return st.floats(low, high)


# Lamps that come by an edit: of a group of the room, and one that is a group of its own.
INSERTED = {"inserted": "glow", "own": "own glow"}
MOVABLES = st.sampled_from(["block", "lamp"])
EDIT = st.one_of(
    st.tuples(st.just("move"), MOVABLES, poses(_floats)),
    st.tuples(st.just("nudge"), MOVABLES, _floats(-0.05, 0.05)),
    st.tuples(st.just("toggle"), MOVABLES),
    st.tuples(st.just("dim"), st.sampled_from(["ceiling", "desk"]), _floats(0, 1)),
    st.tuples(st.just("paint"), st.sampled_from(["wall", "paint"]), _floats(0, 0.9)),
    st.tuples(st.just("insert"), st.sampled_from(sorted(INSERTED)), poses(_floats)),
    st.tuples(st.just("toggle"), st.sampled_from(sorted(INSERTED))),
    st.tuples(st.just("dim"), st.just("own"), _floats(0, 1)),
)
SEQUENCES = st.lists(st.lists(EDIT, min_size=1, max_size=3), min_size=1, max_size=4)


def apply(session: dl.Session, edit) -> None:
    kind, *values = edit
    if kind == "move":
        session.move(*values)
    elif kind == "nudge":
        name, by = values
        pose = session.pose(name)
        pose[:3, 3] = np.clip(pose[:3, 3] + by, (-1.5, 0.45, -1.0), (1.5, 1.5, 1.0))
        session.move(name, pose)
    elif kind == "toggle":
        name = values[0]
        if name in session.poses:
            (session.add if session.poses[name] is None else session.remove)(name)
    elif kind == "dim":
        if values[0] in session.dim_factors:
            session.dim(*values)
    elif kind == "paint":
        name, reflectance = values
        session.set_reflectance(name, (reflectance, 0.5 * reflectance, 0.2))
    elif kind == "insert" and values[0] not in session.poses:
        name, pose = values
        session.add(dl.Mesh(name, *box((0.3, 0.3, 0.3)), INSERTED[name], pose=pose, movable=True))


def equals_recompute(session: dl.Session) -> None:
    """The digest and every read value are those of a computation from scratch."""
    digest, irradiance = session.digest(), session.irradiance
    error, sums = session.standard_error, session.sums
    np.testing.assert_array_equal(session.read()[0], irradiance)
    session.recompute()
    assert session.digest() == digest
    np.testing.assert_array_equal(session.irradiance, irradiance)
    np.testing.assert_array_equal(session.standard_error, error)
    np.testing.assert_array_equal(session.sums, sums)
    energy = session.energy
    assert [a + e for a, e in zip(energy["absorbed"], energy["escaped"], strict=True)] == list(
        energy["emitted"]
    )
