# SPDX-License-Identifier: Apache-2.0
"""Mutated glTF files: valid seeds, then changes to the JSON, the binary data and the container."""

from __future__ import annotations

import copy
import json
import os
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder, png

Rng = np.random.Generator
Seed = tuple[dict[str, Any], bytes]  # JSON and binary data of a valid file
MAX_SEED_BYTES = 60_000
MAX_REPEATED_BYTES = 200_000

COMPONENT_TYPES = [5120, 5121, 5122, 5123, 5125, 5126, 5130]
NUMBERS = [
    0,
    1,
    -1,
    2,
    3,
    4,
    5,
    7,
    255,
    256,
    65535,
    65536,
    0.5,
    -0.0,
    1e-300,
    1e300,
    1e308,
    10**30,
    2**53,
    2**63,
]
NUMBERS += [2**31 - 1, 2**31, 2**32 - 1, 2**32, *COMPONENT_TYPES]
URIS = [
    "../x.bin",
    "/dev/zero",
    "/etc/passwd",
    "data:,",
    "data:;base64,AAAA",
    "http://localhost/",
    "scene.glb",
    ".",
]
EXTENSIONS = ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "KHR_mesh_quantization"]
TEXTS = ["", "SCALAR", "VEC3", "VEC2", "MAT4", "point", "spot", "directional", "MASK", "2.0", "1.0", "MOVE_x"]
TEXTS += ["\x00", "\ud800", "9" * 400, "x" * 10_000, *URIS, *EXTENSIONS]
OTHERS = [None, True, False, [], {}, [[]], [None], {"a": {}}, [0] * 16, [1e30] * 16, [0, 0, 0, 0]]


def plain_seed() -> GltfBuilder:
    """Two nodes, one material, one index type: the least that loads."""
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(builder.material(colour=(0.5, 0.5, 0.5))), name="floor")
    return builder


def rich_seed() -> GltfBuilder:
    """Everything the reader honours, in one file."""
    builder = GltfBuilder()
    texture = {"index": builder.texture(png(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)))}
    glow = builder.material(name="glow", emissiveFactor=[1, 1, 1], emissiveTexture=texture, doubleSided=True)
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 80.0}}
    builder.json["materials"][glow]["extensions"] = strength
    wood = builder.material(
        name="wood",
        pbrMetallicRoughness={"baseColorTexture": texture, "baseColorFactor": [0.5, 0.6, 0.7, 1]},
        alphaMode="MASK",
        extras={"group": "g"},
    )
    glossy = {
        "KHR_materials_pbrSpecularGlossiness": {"diffuseFactor": [1, 1, 1, 1], "diffuseTexture": texture}
    }
    shiny = builder.material(extensions=glossy)
    short = builder.accessor((QUAD * 32767).astype(np.int16), normalized=True)
    sparse = builder.accessor(QUAD)
    builder.json["accessors"][sparse]["sparse"] = {
        "count": 1,
        "indices": {"bufferView": builder.view(b"\2\0"), "componentType": 5123},
        "values": {"bufferView": builder.view(np.ones(3, np.float32).tobytes())},
    }
    rows = np.zeros((4, 6), np.float32)
    rows[:, 3:] = QUAD
    builder.json["accessors"].append(
        {
            "bufferView": builder.view(rows.tobytes(), byteStride=24),
            "byteOffset": 12,
            "componentType": 5126,
            "count": 4,
            "type": "VEC3",
        }
    )
    interleaved = len(builder.json["accessors"]) - 1
    indices = [builder.accessor(QUAD_TRIANGLES.astype(t)) for t in (np.uint8, np.uint16, np.uint32)]
    primitives = [
        {"attributes": {"POSITION": p}, "indices": i, "material": m}
        for p, i, m in zip((short, sparse, interleaved), indices, (glow, wood, shiny), strict=True)
    ]
    mesh = builder.mesh(*primitives, {"attributes": {"POSITION": sparse}, "mode": 5}, name="mesh")
    lines = {"attributes": {}, "mode": 1}
    fan = builder.mesh({"attributes": {"POSITION": sparse, "COLOR_0": 0}, "mode": 6}, lines)
    lamp = builder.node(root=False, name="lamp", extensions=builder.light(type="spot", intensity=90, spot={}))
    wheel = builder.node(root=False, mesh=fan, rotation=[0, 0.6, 0, 0.8], scale=[-1, 2, 3])
    builder.node(name="MOVE_cart", mesh=mesh, children=[lamp, wheel], translation=[1, 2, 3])
    builder.node(name="sun", extensions=builder.light(type="directional", color=[1, 1, 0.5], intensity=1000))
    builder.node(name="bulb", extensions=builder.light(type="point", range=3))
    builder.json["cameras"] = [{"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1}}]
    builder.node(camera=0, matrix=[1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1])
    return builder


def seeds() -> list[Seed]:
    """(JSON, binary data) of valid files: two of our own, and small ones of the folder DELTALUX_SCENES."""
    found: list[Seed] = []
    for builder in (plain_seed(), rich_seed()):
        builder.json["buffers"] = [{"byteLength": len(builder.data)}]
        found.append((builder.json, bytes(builder.data)))
    folder = os.environ.get("DELTALUX_SCENES")
    for path in sorted(Path(folder).rglob("*.glb")) if folder else []:
        data = path.read_bytes()
        if len(data) <= MAX_SEED_BYTES and len(data) >= 28:
            size = struct.unpack_from("<I", data, 12)[0]
            try:
                found.append((json.loads(data[20 : 20 + size]), data[28 + size :]))
            except ValueError:
                continue
    return found


def mutated(rng: Rng, valid: list[Seed]) -> bytes:
    """One file, changed in a place or a few."""
    root, data = valid[rng.integers(len(valid))]
    root = copy.deepcopy(root)
    binary = bytearray(data)
    kind = rng.random()
    if kind < 0.75:
        for _ in range(rng.geometric(0.5)):
            JSON_CHANGES[rng.integers(len(JSON_CHANGES))](rng, root)
    if 0.65 < kind < 0.9:
        for _ in range(rng.geometric(0.5)):
            change_binary(rng, binary)
    if rng.random() < 0.5 and isinstance(root.get("buffers"), list) and root["buffers"]:
        declare_size(root["buffers"][0], binary)
    packed = pack(rng, root, bytes(binary))
    return change_container(rng, packed) if kind > 0.85 else packed


def declare_size(buffer: Any, binary: bytearray) -> None:
    """Make the first buffer's length true, so that later checks are reached."""
    if isinstance(buffer, dict):
        buffer["byteLength"] = len(binary)


def pack(rng: Rng, root: Any, binary: bytes) -> bytes:
    """As GLB mostly, sometimes as JSON without its data."""
    text = json.dumps(root).encode()
    if rng.random() < 0.05:
        return text
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    chunks = (
        struct.pack("<II", len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", len(binary), 0x004E4942)
        + binary
    )
    return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks


def places(root: Any) -> list[tuple[Any, Any]]:
    """Every (container, key) of a JSON tree."""
    found, stack = [], [root]
    while stack:
        item = stack.pop()
        keys = list(item) if isinstance(item, dict) else range(len(item)) if isinstance(item, list) else ()
        for key in keys:
            found.append((item, key))
            stack.append(item[key])
    return found


def pick(rng: Rng, items: list[Any]) -> Any:
    """One of the items."""
    return items[rng.integers(len(items))]


def any_value(rng: Rng) -> Any:
    """A value that some reader has stumbled over."""
    return copy.deepcopy(pick(rng, pick(rng, [NUMBERS, NUMBERS, TEXTS, OTHERS])))


def replace_value(rng: Rng, root: Any) -> None:
    """Put any value at any place."""
    if found := places(root):
        container, key = pick(rng, found)
        container[key] = any_value(rng)


def nudge_number(rng: Rng, root: Any) -> None:
    """Change a number a little, or its sign, size or a bit."""
    found = [(c, k) for c, k in places(root) if isinstance(c[k], int | float) and not isinstance(c[k], bool)]
    if found:
        container, key = pick(rng, found)
        value = container[key]
        bit = 1 << int(rng.integers(40))
        changed = int(value) ^ bit if abs(value) < 2**60 else 0
        small = int(rng.integers(6))  # most integers of a file are indexes of short lists
        container[key] = pick(rng, [value + 1, value - 1, -value, value * 2, changed, small, small])


def delete_value(rng: Rng, root: Any) -> None:
    """Remove a field or an element."""
    if found := places(root):
        container, key = pick(rng, found)
        del container[key]


def copy_value(rng: Rng, root: Any) -> None:
    """Copy one value over another."""
    if found := places(root):
        (source, source_key), (target, key) = pick(rng, found), pick(rng, found)
        target[key] = copy.deepcopy(source[source_key])


def swap_sequence(rng: Rng, root: Any) -> None:
    """Shuffle or repeat a list: nodes, primitives, children, indices."""
    found = [(c, k) for c, k in places(root) if isinstance(c[k], list) and c[k]]
    if found:
        container, key = pick(rng, found)
        items = container[key]
        if rng.random() < 0.5:
            container[key] = [items[i] for i in rng.permutation(len(items))]
        else:
            most = MAX_REPEATED_BYTES // len(json.dumps(items))  # lists in lists would grow without bound
            container[key] = items * int(min(rng.integers(2, 60), max(most, 1)))


def nest_deeply(rng: Rng, root: Any) -> None:
    """Put a deep list at some place."""
    if found := places(root):
        container, key = pick(rng, found)
        deep: Any = []
        for _ in range(int(rng.integers(2, 300))):
            deep = [deep] if rng.random() < 0.5 else {"extras": deep}
        container[key] = deep


def rename_key(rng: Rng, root: Any) -> None:
    """Give a field the name of another one."""
    found = [(c, k) for c, k in places(root) if isinstance(c, dict)]
    if found:
        (container, key), (_, other) = pick(rng, found), pick(rng, found)
        container[other] = container.pop(key)


def multiply_nodes(rng: Rng, root: Any) -> None:
    """Many nodes with one mesh: what instancing can blow up."""
    if isinstance(root.get("nodes"), list) and isinstance(root.get("scenes"), list):
        count = int(rng.integers(10, 1000))
        first = len(root["nodes"])
        root["nodes"].extend({"mesh": 0} for _ in range(count))
        root["scenes"] = [{"nodes": list(range(first, first + count))}]


# Repeated ones come more often: changes that keep the types get further into the reader.
JSON_CHANGES: list[Callable[[Rng, Any], None]] = [
    *[nudge_number] * 8,
    *[replace_value] * 3,
    *[swap_sequence] * 2,
    *[delete_value] * 2,
    copy_value,
    nest_deeply,
    rename_key,
    multiply_nodes,
]


def change_binary(rng: Rng, data: bytearray) -> None:
    """Special floats, random bytes, extreme indices."""
    if len(data) < 8:
        return
    at = int(rng.integers(0, len(data) // 4)) * 4
    special = pick(rng, [np.nan, np.inf, -np.inf, 1e38, -1e-45, 0.0])
    patch = pick(rng, [np.float32(special).tobytes(), b"\xff" * 4, rng.bytes(4), rng.bytes(1), b"\xff\xff"])
    data[at : at + len(patch)] = patch


def change_container(rng: Rng, data: bytes) -> bytes:
    """Cut, flip, insert, or repeat bytes of the whole file."""
    changed = bytearray(data)
    for _ in range(int(rng.integers(1, 6))):
        if not changed:
            break
        at = int(rng.integers(len(changed)))
        # The first bytes hold the lengths that a reader trusts.
        at = int(rng.integers(min(28, len(changed)))) if rng.random() < 0.3 else at
        action = rng.integers(5)
        if action == 0:
            del changed[at:]
        elif action == 1:
            changed[at] ^= 1 << int(rng.integers(8))
        elif action == 2:
            changed[at:at] = rng.bytes(int(rng.integers(1, 16)))
        elif action == 3:
            del changed[at : at + int(rng.integers(1, 16))]
        else:
            changed[at : at + 4] = struct.pack("<I", int(pick(rng, [0, 1, 2**31, 2**32 - 1, len(data)])))
    return bytes(changed)
