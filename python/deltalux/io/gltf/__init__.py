# SPDX-License-Identifier: Apache-2.0
"""glTF 2.0 (.gltf, .glb) to Scene: one module per part of a document."""

from .reader import GROUPINGS, load_gltf

__all__ = ["GROUPINGS", "load_gltf"]
