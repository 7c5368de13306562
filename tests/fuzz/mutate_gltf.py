# SPDX-License-Identifier: Apache-2.0
"""Mutated glTF files: valid seeds, then changes to the JSON, the binary data and the container."""

from __future__ import annotations

import copy
import json
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from builders.gltf import QUAD, QUAD_TRIANGLES, GltfBuilder, png

from fuzz.mutate_bytes import change_bytes, change_numbers
from fuzz.mutate_json import JSON_CHANGES, Rng, pick

Seed = tuple[dict[str, Any], bytes]  # JSON and binary data of a valid file
MAX_SEED_BYTES = 60_000


def plain_seed() -> GltfBuilder:
    """Two nodes, one material, one index type: the least that loads."""
    builder = GltfBuilder()
    builder.node(mesh=builder.quad(builder.material(colour=(0.5, 0.5, 0.5))), name="floor")
    return builder


# long: one of everything, a few lines each.
def rich_seed() -> GltfBuilder:
    """Everything the reader honours, in one file."""
    builder = GltfBuilder()
    texture = {"index": builder.texture(png(np.arange(48, dtype=np.uint8).reshape(4, 4, 3)))}
    glow = builder.material(name="glow", emissiveFactor=[1, 1, 1], emissiveTexture=texture, doubleSided=True)
    strength = {"KHR_materials_emissive_strength": {"emissiveStrength": 80.0}}
    builder.json["materials"][glow]["extensions"] = strength
    builder.json["samplers"] = [{"magFilter": 9728, "minFilter": 9987, "wrapS": 33071, "wrapT": 33648}]
    builder.json["textures"][0]["sampler"] = 0
    placed = {"offset": [0.5, 0.25], "rotation": 0.5, "scale": [2, 3], "texCoord": 1}
    turned = texture | {"extensions": {"KHR_texture_transform": placed}}
    wood = builder.material(
        name="wood",
        pbrMetallicRoughness={"baseColorTexture": turned, "baseColorFactor": [0.5, 0.6, 0.7, 0.5]},
        alphaMode="MASK",
        alphaCutoff=0.25,
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
    corners = QUAD[:, :2]
    texels = [builder.accessor(corners), builder.accessor((255 * corners).astype(np.uint8), normalized=True)]
    primitives = [
        {
            "attributes": {"POSITION": p, "TEXCOORD_0": texels[0], "TEXCOORD_1": texels[1]},
            "indices": i,
            "material": m,
        }
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
    builder.json["cameras"] = [
        {"type": "perspective", "perspective": {"yfov": 0.7, "znear": 0.1, "zfar": 9, "aspectRatio": 2}},
        {"type": "orthographic", "orthographic": {"xmag": 2, "ymag": 1, "znear": 0, "zfar": 9}},
    ]
    builder.node(camera=1, name="plan")
    builder.node(camera=0, matrix=[1, 0, 0, 0, 0.5, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1])
    moves = builder.accessor(np.array([[0, 0, 0], [3, 0, 0]], np.float32))
    instances = {"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": moves}}}
    builder.node(mesh=builder.quad(wood), name="tiles", extensions=instances)
    return builder


def own_seeds() -> list[bytes]:
    """Valid files as GLB."""
    return [plain_seed().glb(), rich_seed().glb()]


def read_seeds(folder: Path) -> list[Seed]:
    """(JSON, binary data) of the small GLB files in a folder."""
    found: list[Seed] = []
    for path in sorted(folder.glob("*.glb")):
        data = path.read_bytes()
        if 28 <= len(data) <= MAX_SEED_BYTES:
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
            pick(rng, GLTF_CHANGES)(rng, root)
    if 0.65 < kind < 0.9:
        for _ in range(rng.geometric(0.5)):
            change_numbers(rng, binary)
    if rng.random() < 0.5 and isinstance(root.get("buffers"), list) and root["buffers"]:
        declare_size(root["buffers"][0], binary)
    packed = pack(rng, root, bytes(binary))
    return change_bytes(rng, packed) if kind > 0.85 else packed


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


def multiply_nodes(rng: Rng, root: Any) -> None:
    """Many nodes with one mesh: what instancing can blow up."""
    if isinstance(root.get("nodes"), list) and isinstance(root.get("scenes"), list):
        count = int(rng.integers(10, 1000))
        first = len(root["nodes"])
        root["nodes"].extend({"mesh": 0} for _ in range(count))
        root["scenes"] = [{"nodes": list(range(first, first + count))}]


GLTF_CHANGES: list[Callable[[Rng, Any], None]] = [*JSON_CHANGES, multiply_nodes]
