# SPDX-License-Identifier: Apache-2.0
"""The part of glTF 2.0's JSON that Deltalux reads, checked and converted to pygltflib objects.

This is the only file that uses pygltflib. Its own parser is not used: it accepts some wrong types, raises
arbitrary exceptions for others, and needs seconds for a thousand meshes.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from typing import Any

import pygltflib as gl

from deltalux.io.diagnostics import clean_name, malformed

# A function of a JSON value and its place; it returns the cleaned value or raises FormatError.
Check = Callable[[Any, str], Any]

MAX_INTEGER = 2**53
MAX_NUMBER = 1e30  # beyond it, products of transforms would leave the range of float64
# What marks a lit file of Deltalux: an attribute beside its COLOR_0, and keys of its materials' extras.
LIT_ATTRIBUTE, LIT_REFLECTANCE, LIT_PANE = "_IRRADIANCE", "deltalux_reflectance", "deltalux_pane"
ATTRIBUTE = re.compile(rf"[A-Z][A-Z0-9_]*|{LIT_ATTRIBUTE}")


def integer(value: Any, where: str) -> int:
    """A non-negative integer; 5.0 counts as one, as in JSON Schema."""
    if isinstance(value, float) and value.is_integer():
        value = int(value)
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value < MAX_INTEGER:
        raise malformed(where, value if not isinstance(value, str) else repr(value), "a non-negative integer")
    return value


def number(value: Any, where: str) -> float:
    """A finite number."""
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= MAX_NUMBER:
        raise malformed(where, _shown(value), "a finite number")
    return float(value)


def boolean(value: Any, where: str) -> bool:
    """true or false."""
    if not isinstance(value, bool):
        raise malformed(where, _shown(value), "true or false")
    return value


def text(value: Any, where: str) -> str:
    """A string, unchanged."""
    if not isinstance(value, str):
        raise malformed(where, _shown(value), "a string")
    return value


def name(value: Any, where: str) -> str:
    """A string that can be printed."""
    return clean_name(text(value, where))


def present(value: Any, where: str) -> dict[str, Any]:
    """Any value; only its presence matters."""
    return {}


def list_of(check: Check, length: int | None = None) -> Check:
    """A list whose elements pass `check`."""

    def check_list(value: Any, where: str) -> list[Any]:
        if not isinstance(value, list) or (length is not None and len(value) != length):
            raise malformed(where, _shown(value), "a list" if length is None else f"a list of {length}")
        return [check(v, f"{where}[{i}]") for i, v in enumerate(value)]

    return check_list


def record(
    fields: Mapping[str, Check],
    required: tuple[str, ...] = (),
    extensions: Mapping[str, Check] | None = None,
    make: Callable[..., Any] = dict,
) -> Check:
    """An object, made by `make`; unknown fields are dropped and null counts as absent."""
    known = {**fields, "extensions": _extensions(extensions or {}), "extras": _extras}

    def check_record(value: Any, where: str) -> Any:
        if not isinstance(value, dict):
            raise malformed(where, _shown(value), "an object")
        for key in required:
            if value.get(key) is None:
                raise malformed(where, f'no "{key}"', "it to be there")
        return make(
            **{k: known[k](v, f"{where}.{k}") for k, v in value.items() if k in known and v is not None}
        )

    return check_record


def _extensions(known: Mapping[str, Check]) -> Check:
    def check_extensions(value: Any, where: str) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise malformed(where, _shown(value), "an object")
        return {k: known.get(k, present)(v, f"{where}.{k}") for k, v in value.items()}

    return check_extensions


def _extras(value: Any, where: str) -> dict[str, Any]:
    # Extras may be any JSON. Deltalux defines these keys; values of other types belong to other programs.
    found = value if isinstance(value, dict) else {}
    extras: dict[str, Any] = {}
    if isinstance(found.get("group"), str) and found["group"]:
        extras["group"] = clean_name(found["group"])
    if isinstance(found.get("movable"), bool | int):  # Blender writes a checkbox as 1
        extras["movable"] = bool(found["movable"])
    if _are_numbers(found.get(LIT_REFLECTANCE), 3, 1.0):
        extras[LIT_REFLECTANCE] = found[LIT_REFLECTANCE]
    if _are_numbers(found.get(LIT_PANE), 6, MAX_NUMBER):
        extras[LIT_PANE] = found[LIT_PANE]
    return extras


def _are_numbers(value: Any, count: int, most: float) -> bool:
    """Whether it is a list of `count` numbers from 0 to `most`."""
    plain = isinstance(value, list) and len(value) == count and not any(isinstance(v, bool) for v in value)
    return plain and all(isinstance(v, int | float) and 0 <= v <= most for v in value)


def _named_integers(value: Any, where: str) -> dict[str, int]:
    if not isinstance(value, dict):
        raise malformed(where, _shown(value), "an object")
    return {k: integer(v, f"{where}.{k}") for k, v in value.items() if ATTRIBUTE.fullmatch(k)}


def _attributes(value: Any, where: str) -> gl.Attributes:
    return gl.Attributes(**_named_integers(value, where))


def _shown(value: Any) -> Any:
    return repr(value[:40]) if isinstance(value, str) else value


_TEXTURE = record(
    {"index": integer, "texCoord": integer},
    required=("index",),
    extensions={
        "KHR_texture_transform": record(
            {
                "offset": list_of(number, 2),
                "rotation": number,
                "scale": list_of(number, 2),
                "texCoord": integer,
            }
        )
    },
    make=gl.TextureInfo,
)

_SPARSE_INDICES = record(
    {"bufferView": integer, "byteOffset": integer, "componentType": integer},
    required=("bufferView", "componentType"),
    make=gl.AccessorSparseIndices,
)

_SPARSE_VALUES = record(
    {"bufferView": integer, "byteOffset": integer}, required=("bufferView",), make=gl.AccessorSparseValues
)

_ACCESSOR = record(
    {
        "bufferView": integer,
        "byteOffset": integer,
        "componentType": integer,
        "count": integer,
        "normalized": boolean,
        "type": text,
        "sparse": record(
            {"count": integer, "indices": _SPARSE_INDICES, "values": _SPARSE_VALUES},
            required=("count", "indices", "values"),
            make=gl.Sparse,
        ),
    },
    required=("componentType", "count", "type"),
    make=gl.Accessor,
)

_RANGE: dict[str, Check] = dict.fromkeys(("buffer", "byteOffset", "byteLength", "byteStride"), integer)

# Compressed data are checked where they are used, because a file may also contain uncompressed data.
_MESHOPT_VIEW = record({**_RANGE, "count": integer, "mode": text, "filter": text})

_BUFFER_VIEW = record(
    _RANGE,
    required=("buffer", "byteLength"),
    extensions={"EXT_meshopt_compression": _MESHOPT_VIEW},
    make=gl.BufferView,
)

_BASE_COLOUR = record(
    {"baseColorFactor": list_of(number, 4), "baseColorTexture": _TEXTURE, "metallicFactor": number},
    make=gl.PbrMetallicRoughness,
)

_MATERIAL = record(
    {
        "name": name,
        "pbrMetallicRoughness": _BASE_COLOUR,
        "normalTexture": present,
        "occlusionTexture": present,
        "emissiveFactor": list_of(number, 3),
        "emissiveTexture": _TEXTURE,
        "alphaMode": text,
        "alphaCutoff": number,
        "doubleSided": boolean,
    },
    extensions={
        "KHR_materials_emissive_strength": record({"emissiveStrength": number}),
        "KHR_materials_transmission": record({"transmissionFactor": number, "transmissionTexture": _TEXTURE}),
        "KHR_materials_ior": record({"ior": number}),
        "KHR_materials_pbrSpecularGlossiness": record(
            {"diffuseFactor": list_of(number, 4), "diffuseTexture": _TEXTURE}
        ),
    },
    make=gl.Material,
)

_PRIMITIVE = record(
    {
        "attributes": _attributes,
        "indices": integer,
        "mode": integer,
        "material": integer,
        "targets": list_of(present),
    },
    required=("attributes",),
    extensions={"KHR_draco_mesh_compression": record({"bufferView": integer, "attributes": _attributes})},
    make=gl.Primitive,
)

_NODE = record(
    {
        "name": name,
        "children": list_of(integer),
        "mesh": integer,
        "skin": integer,
        "camera": integer,
        "matrix": list_of(number, 16),
        "translation": list_of(number, 3),
        "rotation": list_of(number, 4),
        "scale": list_of(number, 3),
    },
    extensions={
        "EXT_mesh_gpu_instancing": record({"attributes": _named_integers}),
        "KHR_lights_punctual": record({"light": integer}, required=("light",)),
        "KHR_node_visibility": record({"visible": boolean}),
    },
    make=gl.Node,
)

_LIGHT = record(
    {
        "name": name,
        "type": text,
        "color": list_of(number, 3),
        "intensity": number,
        "range": number,
        "spot": record({"innerConeAngle": number, "outerConeAngle": number}),
    },
    required=("type",),
)

ORTHOGRAPHIC = ("xmag", "ymag", "znear", "zfar")

_CAMERA = record(
    {
        "name": name,
        "type": text,
        "perspective": record(
            dict.fromkeys(("yfov", "aspectRatio", "znear", "zfar"), number),
            required=("yfov",),
            make=gl.Perspective,
        ),
        "orthographic": record(
            dict.fromkeys(ORTHOGRAPHIC, number), required=ORTHOGRAPHIC, make=gl.Orthographic
        ),
    },
    make=gl.Camera,
)

# Converts the file's JSON to a pygltflib.GLTF2 with checked types; indexes are checked where they are used.
GLTF = record(
    {
        "asset": record({"version": text, "generator": text}, required=("version",), make=gl.Asset),
        "extensionsUsed": list_of(name),
        "extensionsRequired": list_of(name),
        "scene": integer,
        "scenes": list_of(record({"name": name, "nodes": list_of(integer)}, make=gl.Scene)),
        "nodes": list_of(_NODE),
        "meshes": list_of(
            record({"name": name, "primitives": list_of(_PRIMITIVE)}, required=("primitives",), make=gl.Mesh)
        ),
        "materials": list_of(_MATERIAL),
        "textures": list_of(
            record(
                {"source": integer, "sampler": integer},
                extensions={"EXT_texture_webp": record({"source": integer})},
                make=gl.Texture,
            )
        ),
        "images": list_of(record({"name": name, "uri": text, "bufferView": integer}, make=gl.Image)),
        "samplers": list_of(
            record(dict.fromkeys(("magFilter", "minFilter", "wrapS", "wrapT"), integer), make=gl.Sampler)
        ),
        "accessors": list_of(_ACCESSOR),
        "bufferViews": list_of(_BUFFER_VIEW),
        "buffers": list_of(
            record(
                {"uri": text, "byteLength": integer},
                required=("byteLength",),
                extensions={"EXT_meshopt_compression": record({"fallback": boolean})},
                make=gl.Buffer,
            )
        ),
        "cameras": list_of(_CAMERA),
        "skins": list_of(present),
        "animations": list_of(present),
    },
    required=("asset",),
    extensions={"KHR_lights_punctual": record({"lights": list_of(_LIGHT)}, required=("lights",))},
    make=gl.GLTF2,
)
