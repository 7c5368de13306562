# SPDX-License-Identifier: Apache-2.0
"""Rooms that several test modules share: with pools of spots, with a sun in a window; and edits."""

from __future__ import annotations

from collections.abc import Callable

import deltalux as dl
import numpy as np
from hypothesis import strategies as st
from rooms import box, translation, turn

DOWN = (-0.5, -1.0, -0.2)  # from the sun


def spot(name, position, direction, angle, candela, **fields):
    """A spot of `angle` degrees from edge to edge."""
    return dl.SpotLight(
        name,
        position,
        direction,
        (candela,) * 3,
        outer_angle=np.radians(angle / 2),
        inner_angle=0.0,
        **fields,
    )


def pools() -> dl.Scene:
    """A room with pools on floor, table and wall; a movable block and a movable lamp with a spot."""
    return dl.Scene(
        [
            dl.Mesh("walls", *box((6, 2.8, 5), (0, 1.4, 0), inward=True), "wall"),
            dl.Mesh("table", *box((1.2, 0.05, 0.8), (1, 0.72, 0.5)), "wood"),
            dl.Mesh("speck", *box((0.08, 0.08, 0.08), (1.2, 0.79, 0.5)), "wood"),
            dl.Mesh("block", *box((0.4, 0.5, 0.4)), "wood", pose=translation(-1, 0.26, 0.6), movable=True),
            dl.Mesh("lamp", *box((0.1, 0.1, 0.1)), "wood", pose=translation(0, 2.5, -2), movable=True),
        ],
        [dl.Material("wall", (0.7, 0.7, 0.65)), dl.Material("wood", (0.5, 0.35, 0.2))],
        [
            spot("a", (-1.8, 2.7, -1), (0, -1, 0), 4, 4000, group="a"),
            spot("b", (1.1, 2.7, 0.5), (0, -1, 0), 8, 1000, group="b"),
            spot("c", (0, -0.1, 0), (0.2, -0.6, -0.3), 20, 150, group="c", attached_to="lamp"),
        ],
    )


def pools_and_sconce() -> dl.Scene:
    """The pools, and a strip lamp whose shade lights nothing but a strip of the wall behind it."""
    scene = pools()
    shade = dl.Mesh("shade", *box((0.02, 0.2, 0.3), (-2.8, 1.5, 1.5)), "wood")
    x, y, z = -2.82, 0.06, 0.12
    strip = np.array([(x, 1.5 + b * y, 1.5 + a * z) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))])
    lamp = dl.Mesh("strip", strip, [(0, 1, 2), (0, 2, 3)], "strip")
    material = dl.Material("strip", (0.5,) * 3, (1500,) * 3, group="strip")
    return dl.Scene([*scene.meshes, shade, lamp], [*scene.materials, material], scene.lights)


POOL_EDITS = st.one_of(
    st.tuples(st.just("block"), st.floats(-2.5, 2.5), st.floats(0.26, 2), st.floats(-2, 2)),
    st.tuples(st.just("lamp"), st.floats(-2.5, 2.5), st.floats(1.5, 2.6), st.floats(-2, 2)),
    st.tuples(st.just("dim"), st.sampled_from(["a", "b", "c", "strip"]), st.sampled_from([0.0, 0.5, 2.0])),
    st.tuples(st.just("paint"), st.sampled_from(["wall", "wood"]), st.floats(0, 0.9)),
    st.tuples(st.just("toggle"), st.sampled_from(["block", "lamp"])),
    st.tuples(st.just("budget"), st.sampled_from(["block", "lamp"]), st.floats(-2.5, 2.5)),
)


def edit_pools(session: dl.Session, kind: str, *values) -> None:
    if kind == "dim":
        session.dim(*values)
    elif kind == "paint":
        session.set_reflectance(values[0], (values[1],) * 3)
    elif kind == "toggle":
        (session.add if session.poses[values[0]] is None else session.remove)(values[0])
    elif kind == "budget":
        session.move(values[0], translation(values[1], 1.2, 0.4))
        session.update(budget_ms=0.01)
    else:
        session.move(kind, translation(*values))


def follow_edits(session: dl.Session, edit: Callable[..., None], edits: list) -> None:
    """Make these edits one by one; after those within a budget, what they leave waits for the next one."""
    for one in edits:
        edit(session, *one)
        if one[0] != "budget":
            session.update()
    session.update()


def sheets(*quads) -> tuple[np.ndarray, list]:
    corners = np.concatenate(quads).astype(float)
    return corners, [t for k in range(0, len(corners), 4) for t in ((k, k + 1, k + 2), (k, k + 2, k + 3))]


def sunny_room() -> dl.Scene:
    """A window and a terrace, a sun that turns with a dial, a lamp, a block that may stand in the sun."""
    low, high = 0.9, 2.1
    wall = [
        [(2, y, z), (2, y, w), (2, v, w), (2, v, z)]
        for y, v, z, w in (
            (0, low, -2, 2),
            (high, 2.8, -2, 2),
            (low, high, -2, -0.6),
            (low, high, 0.6, 2),
        )
    ]
    rest = [
        [(-2, 0, -2), (-2, 0, 2), (2, 0, 2), (2, 0, -2)],
        [(-2, 2.8, -2), (2, 2.8, -2), (2, 2.8, 2), (-2, 2.8, 2)],
        [(-2, 0, -2), (2, 0, -2), (2, 2.8, -2), (-2, 2.8, -2)],
        [(-2, 0, 2), (-2, 2.8, 2), (2, 2.8, 2), (2, 0, 2)],
        [(-2, 0, -2), (-2, 2.8, -2), (-2, 2.8, 2), (-2, 0, 2)],
        [(2, -0.1, -2), (2, -0.1, 2), (4, -0.1, 2), (4, -0.1, -2)],
    ]
    return dl.Scene(
        [
            dl.Mesh("walls", *sheets(*wall, *rest), "wall"),
            dl.Mesh("table", *box((0.8, 0.05, 0.6), (0.3, 0.7, 0.3)), "wood"),
            dl.Mesh("block", *box((0.4, 0.5, 0.4)), "wood", pose=translation(-1, 0.26, 0.6), movable=True),
            dl.Mesh("dial", *box((0.1, 0.1, 0.1)), "wood", pose=translation(-1, 2, -1), movable=True),
        ],
        [dl.Material("wall", (0.7, 0.7, 0.65)), dl.Material("wood", (0.5, 0.35, 0.2))],
        [
            dl.SunLight("sun", DOWN, (500,) * 3, group="sun", attached_to="dial"),
            dl.PointLight("bulb", (0, 2.6, 0), (5,) * 3, group="bulb"),
        ],
    )


SUN_EDITS = st.one_of(
    st.tuples(st.just("block"), st.floats(-1.7, 3.5), st.floats(0.26, 2.4), st.floats(-1.7, 1.7)),
    st.tuples(st.just("dial"), st.floats(-0.8, 0.8)),
    st.tuples(st.just("dim"), st.sampled_from(["sun", "bulb"]), st.sampled_from([0.0, 0.5, 2.0])),
    st.tuples(st.just("paint"), st.sampled_from(["wall", "wood"]), st.floats(0, 0.9)),
    st.tuples(st.just("toggle"), st.sampled_from(["block", "dial"])),
    st.tuples(st.just("budget"), st.floats(-1.7, 3.5)),
)


def edit_sun(session: dl.Session, kind: str, *values) -> None:
    if kind == "block":
        session.move("block", translation(*values))
    elif kind == "dial":
        session.move("dial", translation(-1, 2, -1) @ turn(values[0]))
    elif kind == "dim":
        session.dim(*values)
    elif kind == "paint":
        session.set_reflectance(values[0], (values[1],) * 3)
    elif kind == "toggle":
        (session.add if session.poses[values[0]] is None else session.remove)(values[0])
    else:
        session.move("block", translation(values[0], 0.6, 0.2))
        session.update(budget_ms=1e-3)
