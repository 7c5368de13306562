# SPDX-License-Identifier: Apache-2.0
"""What a hostile page may send: good messages, messages of good shape with bad values, broken ones."""

from __future__ import annotations

import copy
import json
from typing import Any

import numpy as np
from deltalux.server.edits import pose_numbers
from deltalux.server.protocol.messages import MAX_TEXT
from rooms import translation, turn

from fuzz.mutate_bytes import change_bytes
from fuzz.mutate_json import OTHERS, Rng, any_value, change_json, pick

MOVABLES, GROUPS, MATERIALS = (
    ["block", "lamp"],
    ["ceiling", "desk"],
    ["wall", "paint", "ceiling glow", "glow"],
)
FIXED = ["walls", "ceiling lamp"]
FILES = [
    "a.glb",
    "b.csv",
    "c.npz",
    "d.dlx",
    "d.dlx",
    "..",
    "../up.glb",
    "/tmp/x.dlx",
    "a/b.dlx",
    "a.txt",
    ".dlx",
]
FILES += [
    "x" * 300 + ".csv",
    "ünï.csv",
    "a\x00.csv",
    "a\n.dlx",
    "theirs.csv",
    "link.dlx",
    "",
    " .glb",
    "a.GLB",
]
ARRAYS = ["irradiance"] * 4 + ["standard_error", "points", "normals", "light", None]
NUMBERS = [
    0,
    1,
    -1,
    0.5,
    2,
    1e-300,
    5e-324,
    1e6,
    1e6 + 1,
    1e15,
    -1e15,
    1e300,
    2**53,
    -0.0,
    10**400,
    True,
    None,
]
TEXTS = [
    "",
    "{",
    "[]",
    "null",
    "NaN",
    '{"type": "ack", "seq": NaN}',
    "[" * 60_000,
    "1" * 9999,
    '{"type":' * 9000,
]
TEXTS += ['"\\ud800"', '{"type":"undo","type":"bake","id":1,"id":2}', "\u2028", '{"type":"undo","id":1e999}']


def pose(rng: Rng) -> Any:
    """A pose: mostly inside the room, sometimes outside, sometimes no pose."""
    kind = rng.random()
    size = 1.0 if kind < 0.7 else 30.0
    offset = rng.uniform((-1.6, 0.4, -1.1), (1.6, 1.6, 1.1)) * size
    numbers = list(pose_numbers(translation(*offset) @ turn(rng.uniform(0, 6))))
    if kind > 0.85:
        numbers[rng.integers(16)] = pick(rng, NUMBERS)
    return numbers[: rng.integers(17)] if kind > 0.97 else numbers


def number(rng: Rng) -> Any:
    """A number from 0 to 1, or a bad one."""
    return float(rng.random()) if rng.random() < 0.7 else pick(rng, NUMBERS)


def request(rng: Rng) -> dict[str, Any]:
    """A message of good shape."""
    kinds = (
        ["move"] * 8 + ["dim"] * 3 + ["reflectance"] * 2 + ["remove", "add"] * 2 + ["undo"] * 4 + ["redo"] * 2
    )
    kinds += ["finish", "read", "edit", "edit", "make_movable", "add_lamp"]
    kind = str(pick(rng, [*kinds, "bake", "check", "cancel", "budget", "export", "ack", "ack"]))
    message: dict[str, Any] = {"type": kind, "id": int(rng.integers(1000))}
    if kind in ("move", "remove", "add"):
        message["name"] = pick(rng, MOVABLES)
    if kind == "move":
        message["pose"] = pose(rng)
    elif kind == "dim":
        message |= {"group": pick(rng, GROUPS), "factor": number(rng)}
    elif kind == "reflectance":
        message |= {"material": pick(rng, MATERIALS), "value": [number(rng) for _ in range(3)]}
    elif kind == "budget":
        message["milliseconds"] = pick(rng, [None, 1, 1.5, 50, 10_000, *NUMBERS])
    elif kind == "finish" and rng.random() < 0.7:
        message["digest"] = pick(rng, [True, False, True, None, 1])
    elif kind == "read":
        message["arrays"] = [pick(rng, ARRAYS) for _ in range(rng.integers(4))]
    elif kind == "edit":
        message["edits"] = [request(rng) for _ in range(rng.integers(4))]
        for each in message["edits"]:
            each.pop("id", None)
    elif kind == "make_movable":
        message["mesh"] = pick(rng, [*MOVABLES, *FIXED])
    elif kind == "add_lamp":
        message["position"] = pose(rng)[12:15]
    elif kind == "export":
        message["file"] = pick(rng, FILES)
    elif kind == "ack":
        message = {"type": "ack", "seq": int(pick(rng, [0, 1, 2, 3, 5, 100, 2**32 - 1]))}
    if kind in ("move", "dim", "reflectance") and rng.random() < 0.6:
        message["dragging"] = bool(rng.random() < 0.7)
    return message


def text(rng: Rng) -> str:
    """One message as text."""
    kind = rng.random()
    if kind < 0.04:
        return str(pick(rng, TEXTS))
    if kind < 0.06:
        return json.dumps(pick(rng, OTHERS))
    message = copy.deepcopy(request(rng))
    if kind < 0.16:
        change_json(rng, message)
    elif kind < 0.2:
        message[str(pick(rng, [*message, "more"]))] = any_value(rng)
    written = json.dumps(message)
    if kind > 0.97:
        return change_bytes(rng, written.encode()).decode("utf-8", "replace")
    return written


def steps(rng: Rng) -> list[list[Any]]:
    """A sequence over up to four pages: send, leave, come, fetch, wait."""
    sequence: list[list[Any]] = []
    for _ in range(int(rng.integers(5, 60))):
        page, kind = int(rng.integers(4)), rng.random()
        if kind < 0.8:
            sequence.append(["send", page, text(rng)])
        elif kind < 0.86:
            sequence.append(["fetch", page])
        elif kind < 0.9:
            sequence.append(["leave", page])
        else:
            sequence.append(["wait", float(pick(rng, [0.0, 0.001, 0.01, 0.05]))])
    return sequence


def websocket_frame(rng: Rng) -> bytes:
    """A frame as a client sends it, or nearly so."""
    payload = text(rng).encode("utf-8", "surrogatepass")
    kind = rng.random()
    if kind < 0.1:
        payload = rng.bytes(int(rng.integers(200)))
    elif kind < 0.13:
        payload = b'"' + b"x" * (MAX_TEXT + 100) + b'"'
    opcode = int(pick(rng, [1] * 12 + [0, 2, 8, 9, 10, 3, 15]))
    first = opcode | (0x80 if rng.random() < 0.95 else 0) | (0x40 if rng.random() < 0.03 else 0)
    length = len(payload)
    if rng.random() < 0.03:
        length = int(pick(rng, [0, 125, 2**16, 2**31, 2**63]))
    masked = 0x80 if rng.random() < 0.97 else 0
    if length < 126:
        head = bytes([first, masked | length])
    elif length < 2**16:
        head = bytes([first, masked | 126]) + length.to_bytes(2, "big")
    else:
        head = bytes([first, masked | 127]) + length.to_bytes(8, "big")
    mask = rng.bytes(4)
    body = bytes(
        np.bitwise_xor(
            np.frombuffer(payload, np.uint8), np.resize(np.frombuffer(mask, np.uint8), len(payload))
        )
    )
    frame = head + (mask if masked else b"") + (body if masked else payload)
    return change_bytes(rng, frame) if rng.random() < 0.05 else frame


def http_request(rng: Rng) -> bytes:
    """A request of good form, TOKEN and PORT to be filled in; or nearly so."""
    path = str(
        pick(
            rng, ["/", "/scene.json", "/geometry.bin", "/files/a.dlx", "/files/..%2f..%2fetc", "/ws", "/%00"]
        )
    )
    lines = [
        f"{pick(rng, ['GET', 'GET', 'GET', 'POST', 'HEAD', 'PUT', 'ÿ'])} {path}?token=TOKEN HTTP/1.1",
        f"Host: {pick(rng, ['127.0.0.1:PORT'] * 5 + ['evil', '', '[::1', '127.0.0.1:999999'])}",
        f"Content-Length: {pick(rng, [0, 0, 0, -1, 10**20, 'x'])}",
        f"X: {'y' * int(pick(rng, [1, 100, 70_000]))}",
    ]
    if path == "/ws":
        lines += ["Upgrade: websocket", "Connection: Upgrade", "Sec-WebSocket-Version: 13"]
        lines += [f"Sec-WebSocket-Key: {pick(rng, ['dGhlIHNhbXBsZSBub25jZQ==', '', 'x'])}"]
    data = ("\r\n".join(lines) + "\r\n\r\n").encode("latin-1")
    return change_bytes(rng, data) if rng.random() < 0.3 else data


def connections(rng: Rng) -> list[dict[str, Any]]:
    """What is sent over some connections, as latin-1; `handshake` comes first where it is true."""
    found = []
    for _ in range(int(rng.integers(1, 6))):
        handshake = bool(rng.random() < 0.75)
        data = (
            [websocket_frame(rng) for _ in range(rng.integers(1, 30))] if handshake else [http_request(rng)]
        )
        found.append({"handshake": handshake, "data": [piece.decode("latin-1") for piece in data]})
    return found
