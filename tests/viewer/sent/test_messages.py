# SPDX-License-Identifier: Apache-2.0
"""Messages of pages: what is understood, what is refused, and that nonsense does nothing."""

from __future__ import annotations

import json

import numpy as np
import pytest
from deltalux.server.edits import pose_numbers
from deltalux.server.protocol.messages import (
    REQUESTS,
    Ack,
    BadMessage,
    Budget,
    Move,
    Names,
    Reflectance,
    parse,
)
from hypothesis import given, settings
from hypothesis import strategies as st

NAMES = Names(["block", "lamp"], ["ceiling"], ["paint"], ["walls"])
POSE = list(pose_numbers(np.eye(4)))
GOOD = {
    "move": {"name": "block", "pose": POSE, "dragging": True},
    "remove": {"name": "block"},
    "add": {"name": "lamp"},
    "dim": {"group": "ceiling", "factor": 0.5},
    "dims": {"factors": {"ceiling": 0.5}, "dragging": True},
    "reflectance": {"material": "paint", "value": [0.1, 0.2, 0.3]},
    "budget": {"milliseconds": None},
    "export": {"file": "a.glb"},
    "edit": {"edits": [{"type": "remove", "name": "block"}]},
    "read": {"arrays": ["irradiance"]},
    "make_movable": {"mesh": "walls"},
    "add_lamp": {"position": [0.0, 1.0, 0.5]},
}


def read(**fields):
    return parse(json.dumps(fields), NAMES)


@pytest.mark.parametrize("kind", REQUESTS)
def test_every_type_is_understood(kind):
    message = read(type=kind, id=7, **GOOD.get(kind, {}))
    assert isinstance(message, REQUESTS[kind])
    assert message.id == 7


def test_fields_arrive():
    assert read(type="move", id=1, **GOOD["move"]) == Move(1, "block", tuple(POSE), True)
    assert read(type="reflectance", id=1, **GOOD["reflectance"]) == Reflectance(1, "paint", (0.1, 0.2, 0.3))
    assert read(type="budget", id=1, milliseconds=20) == Budget(1, 20.0)
    assert read(type="ack", seq=3) == Ack(3)


def with_entry(index, value):
    pose = list(POSE)
    pose[index] = value
    return {"name": "block", "pose": pose}


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"type": "explode", "id": 1}, 'type: found "explode", expected one of move, remove'),
        ({"id": 1}, "type: found null"),
        ({"type": ["move"], "id": 1}, "type: found"),
        ({"type": "undo"}, "undo: found no id, expected id"),
        ({"type": "undo", "id": "1"}, 'id: found "1", expected a number'),
        ({"type": "undo", "id": True}, "id: found true"),
        ({"type": "undo", "id": 10**400}, "id: found 1000"),
        ({"type": "undo", "id": 1, "more": 2}, 'undo: found the field "more", expected id'),
        ({"type": "remove", "id": 1, "name": "walls"}, 'name: found "walls", expected one of'),
        ({"type": "remove", "id": 1, "name": "\ud800"}, "name: found"),
        ({"type": "remove", "id": 1, "name": ["block"]}, "name: found"),
        (
            {"type": "dim", "id": 1, "group": "ceiling", "factor": -1},
            "factor: found -1, expected a number from 0",
        ),
        ({"type": "dim", "id": 1, "group": "ceiling", "factor": 1e7}, "factor: found 1"),
        ({"type": "dim", "id": 1, "group": "ceiling", "factor": 1, "dragging": 1}, "dragging: found 1"),
        ({"type": "dims", "id": 1, "factors": {}}, "factors: found {}, expected an object of factors"),
        ({"type": "dims", "id": 1, "factors": {"walls": 1}}, 'group: found "walls"'),
        ({"type": "dims", "id": 1, "factors": {"ceiling": -1}}, "factor: found -1"),
        ({"type": "reflectance", "id": 1, "material": "paint", "value": [0.1, 0.2]}, "expected 3 numbers"),
        ({"type": "reflectance", "id": 1, "material": "paint", "value": [0, 0, 1.5]}, "value: found 1.5"),
        ({"type": "move", "id": 1, "name": "block", "pose": POSE[:15]}, "pose: .* expected 16 numbers"),
        ({"type": "move", "id": 1, **with_entry(3, 0.1)}, "scales, shears or mirrors"),
        ({"type": "move", "id": 1, **with_entry(0, 2)}, "scales, shears or mirrors"),
        ({"type": "move", "id": 1, **with_entry(0, -1)}, "scales, shears or mirrors"),
        ({"type": "move", "id": 1, **with_entry(12, "x")}, 'pose: found "x"'),
        ({"type": "move", "id": 1, **with_entry(12, 1e300)}, "pose: found 1e\\+300"),
        ({"type": "budget", "id": 1, "milliseconds": 0}, "milliseconds: found 0"),
        ({"type": "export", "id": 1, "file": 3}, "file: found 3"),
        ({"type": "ack"}, "ack: found no seq"),
        ({"type": "ack", "seq": 1.5}, "seq: found 1.5"),
        ({"type": "ack", "seq": -1}, "seq: found -1"),
    ],
)
def test_wrong_fields_are_refused(fields, text):
    with pytest.raises(BadMessage, match=text):
        read(**fields)


@pytest.mark.parametrize(
    "text",
    ["", "{", "[]", "3", "null", '"move"', "NaN", '{"type": "ack", "seq": NaN}', "[" * 60_000, "1" * 9999,
     '{"type":"dim","id":1,"group":"ceiling","factor":1e999}'],
)  # fmt: skip
def test_what_is_no_message_is_refused(text):
    with pytest.raises(BadMessage):
        parse(text, NAMES)


def test_an_error_names_the_request_where_it_has_a_number():
    with pytest.raises(BadMessage) as caught:
        read(type="remove", id=12, name="nobody")
    assert caught.value.id == 12
    with pytest.raises(BadMessage) as caught:
        read(type="remove", id="twelve", name="block")
    assert caught.value.id is None


LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8)
VALUES = LEAVES | st.lists(LEAVES, max_size=16) | st.dictionaries(st.text(max_size=8), LEAVES, max_size=3)
FIELDS = ("type", "id", "name", "pose", "dragging", "group", "factor", "material", "value", "file", "seq")


@settings(deadline=None)
@given(
    st.dictionaries(st.sampled_from(FIELDS) | st.text(max_size=5), VALUES),
    st.sampled_from([*REQUESTS, "ack"]),
)
def test_random_json_is_a_message_or_refused(data, kind):
    for fields in (data, data | {"type": kind, "id": 1}):
        try:
            message = parse(json.dumps(fields), NAMES)
        except BadMessage:
            continue
        assert message.type in (*REQUESTS, "ack")


@given(st.text())
def test_random_text_is_refused(text):
    with pytest.raises(BadMessage):
        parse(text, NAMES)
