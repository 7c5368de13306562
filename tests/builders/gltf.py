# SPDX-License-Identifier: Apache-2.0
"""Writes small glTF files, valid or deliberately not."""

from __future__ import annotations

import base64
import io
import json
import struct
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

COMPONENT_OF = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}
WIDTH_NAME = {1: "SCALAR", 2: "VEC2", 3: "VEC3", 4: "VEC4"}

# The unit square in the plane z = 0, facing +Z.
QUAD = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
QUAD_TRIANGLES = np.array([0, 1, 2, 0, 2, 3], np.uint16)


class GltfBuilder:
    """Collects JSON and binary data; everything in `json` may be changed before writing."""

    def __init__(self) -> None:
        self.data = bytearray()
        self.json: dict[str, Any] = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "accessors": [],
            "bufferViews": [],
        }

    def _append(self, key: str, item: dict[str, Any]) -> int:
        items = self.json.setdefault(key, [])
        items.append(item)
        return len(items) - 1

    def view(self, data: bytes, **fields: Any) -> int:
        """Append a buffer view with these bytes."""
        self.data.extend(b"\0" * (-len(self.data) % 4))
        offset = len(self.data)
        self.data.extend(data)
        return self._append(
            "bufferViews", {"buffer": 0, "byteOffset": offset, "byteLength": len(data), **fields}
        )

    def accessor(self, values: np.ndarray, **fields: Any) -> int:
        """Append an accessor over the array's own component type, (n,) or (n, width)."""
        values = np.asarray(values)
        width = 1 if values.ndim == 1 else values.shape[1]
        kind = values.dtype.kind + str(values.dtype.itemsize)
        view = self.view(values.astype(values.dtype.newbyteorder("<")).tobytes())
        record = {
            "bufferView": view,
            "componentType": COMPONENT_OF[kind],
            "count": len(values),
            "type": WIDTH_NAME[width],
        }
        return self._append("accessors", record | fields)

    def mesh(self, *primitives: dict[str, Any], **fields: Any) -> int:
        """Append a mesh of these primitives."""
        return self._append("meshes", {"primitives": list(primitives), **fields})

    def quad(self, material: int | None = None, **fields: Any) -> int:
        """Append a mesh with the unit square in z = 0, facing +Z."""
        primitive = {
            "attributes": {"POSITION": self.accessor(QUAD)},
            "indices": self.accessor(QUAD_TRIANGLES),
        }
        if material is not None:
            primitive["material"] = material
        return self.mesh(primitive, **fields)

    def node(self, *, root: bool = True, **fields: Any) -> int:
        """Append a node, as a root of the scene or for a `children` list."""
        index = self._append("nodes", fields)
        if root:
            self.json["scenes"][0]["nodes"].append(index)
        return index

    def material(self, *, colour: Any = None, **fields: Any) -> int:
        """Append a material; `colour` is the base colour of a non-metal."""
        if colour is not None:
            fields["pbrMetallicRoughness"] = {"baseColorFactor": [*colour, 1], "metallicFactor": 0}
        return self._append("materials", fields)

    def texture(self, image: bytes) -> int:
        """Append a texture whose image lies in the binary chunk."""
        source = self._append("images", {"bufferView": self.view(image), "mimeType": "image/png"})
        return self._append("textures", {"source": source})

    def light(self, **fields: Any) -> dict[str, Any]:
        """Append a light of KHR_lights_punctual; returns the `extensions` for its node."""
        root = self.json.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})
        root["lights"].append(fields)
        self.use("KHR_lights_punctual")
        return {"KHR_lights_punctual": {"light": len(root["lights"]) - 1}}

    def use(self, name: str, *, required: bool = False) -> None:
        """List an extension as used, and perhaps as required."""
        for key in ("extensionsUsed", *(("extensionsRequired",) if required else ())):
            names = self.json.setdefault(key, [])
            if name not in names:
                names.append(name)

    def glb(self) -> bytes:
        """The file as GLB."""
        data = bytes(self.data) + b"\0" * (-len(self.data) % 4)
        root = dict(self.json)
        if data:
            root.setdefault("buffers", [{"byteLength": len(data)}])
        text = json.dumps(root).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        if data:
            chunks += struct.pack("<II", len(data), 0x004E4942) + data
        return b"glTF" + struct.pack("<II", 2, 12 + len(chunks)) + chunks

    def gltf(self, uri: str | None = None) -> bytes:
        """The file as JSON, its buffer at `uri` or embedded."""
        embedded = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        root = dict(self.json)
        root.setdefault("buffers", [{"byteLength": len(self.data), "uri": uri or embedded}])
        return json.dumps(root).encode()

    def write(self, folder: Path, name: str = "scene.glb") -> Path:
        """Write into a folder, as GLB or, by the suffix, as embedded JSON."""
        path = folder / name
        path.write_bytes(self.glb() if path.suffix == ".glb" else self.gltf())
        return path


def png(pixels: np.ndarray) -> bytes:
    """A PNG of an image array."""
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "PNG")
    return stream.getvalue()
