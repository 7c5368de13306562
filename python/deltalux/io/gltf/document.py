# SPDX-License-Identifier: Apache-2.0
"""A checked glTF document: container, types, version and extensions."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

from deltalux.errors import FormatError
from deltalux.io.decoding.process import PACKAGES, missing_package
from deltalux.io.diagnostics import Notes, malformed

from .container import read_container
from .schema import GLTF

HONOURED = {
    "EXT_mesh_gpu_instancing",
    "EXT_texture_webp",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_pbrSpecularGlossiness",  # its diffuse part
    "KHR_materials_transmission",
    "KHR_mesh_quantization",
    "KHR_node_visibility",
    "KHR_texture_transform",
}
COMPRESSION = {"EXT_meshopt_compression", "KHR_draco_mesh_compression", "KHR_meshopt_compression"}
# These affect only appearance; Deltalux treats all surfaces as diffuse, so a file may require them.
APPEARANCE = {
    "KHR_materials_" + name
    for name in (
        "anisotropy", "clearcoat", "diffuse_transmission", "dispersion", "ior", "iridescence", "sheen",
        "specular", "transmission", "unlit", "variants", "volume",
    )
}  # fmt: skip


@dataclass(frozen=True)
class Document:
    """A glTF file after all checks that need no buffer.

    `gltf` is a pygltflib.GLTF2, whose types are checked, but not its indexes.
    """

    path: Path
    gltf: Any
    blob: bytes | None
    notes: Notes

    def files(self) -> list[str]:
        """Absolute paths of the document and of all files that it references, read or not."""
        uris = [each.uri for each in (*self.gltf.buffers, *self.gltf.images) if each.uri is not None]
        named = [unquote(uri) for uri in uris if uri[:5].lower() != "data:"]
        return [str(path.absolute()) for path in (self.path, *(self.path.parent / name for name in named))]


def read_document(path: Path) -> Document:
    """Read and check the JSON of a .gltf or .glb file; FormatError describes any defect."""
    root, blob = read_container(path)
    _check_version(root)
    gltf = GLTF(root, "glTF")
    _check_required(gltf.extensionsRequired)
    document = Document(path, gltf, blob, Notes())
    _note_unhonoured(document)
    return document


def compression_remedy(name: str) -> str | None:
    """The remedy for data that extension `name` compressed; None if they can be decoded."""
    return missing_package(name) if name in PACKAGES else "export the file without compression"


def _check_version(root: dict[str, Any]) -> None:
    # Before the schema check: the best message about a glTF 1.0 file is its version.
    asset = root.get("asset")
    version = asset.get("version") if isinstance(asset, dict) else None
    minimum = asset.get("minVersion", "2.0") if isinstance(asset, dict) else "2.0"
    if not isinstance(version, str) or not re.fullmatch(r"2\.\d{1,3}", version) or minimum != "2.0":
        shown = version if minimum == "2.0" else {"minVersion": minimum}
        raise malformed("asset.version", repr(shown)[:60], '"2.0"', "convert the file to glTF 2.0")


def _check_required(required: list[str]) -> None:
    for name in required:
        if name in COMPRESSION and (remedy := compression_remedy(name)):
            raise FormatError(
                f"extension {name}: found compressed geometry, which is not supported here, expected plain "
                f"accessors; {remedy}"
            )
        if name not in HONOURED | APPEARANCE | COMPRESSION:
            raise FormatError(
                f'extension "{name}": the file requires it, but it is not supported; expected only '
                f"{', '.join(sorted(HONOURED))} and material extensions; export the file without it"
            )


def _note_unhonoured(document: Document) -> None:
    gltf, notes = document.gltf, document.notes
    for name in sorted({*gltf.extensionsUsed, *gltf.extensionsRequired} - HONOURED):
        if name in COMPRESSION:
            if compression_remedy(name):
                notes.add(f"extension {name} is present but not honoured: uncompressed data are read instead")
        else:
            notes.add(f"extension {name} is present but not honoured")
    if gltf.animations:
        notes.add("animations are present but not honoured: nodes stand as authored")
