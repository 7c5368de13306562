# SPDX-License-Identifier: Apache-2.0
"""Results made up to be written, and the .glb that holds them read back; for several test modules."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pygltflib
from deltalux.results import Result

TYPES = {5123: np.uint16, 5125: np.uint32, 5126: np.float32}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


def result_for(points: np.ndarray, normals: np.ndarray, unit: str = "lux", **about: object) -> Result:
    random = np.random.default_rng(5)
    return Result(
        points=points,
        normals=normals,
        irradiance=random.uniform(0, 900, (len(points), 3)),
        standard_error=random.uniform(0, 9, (len(points), 3)),
        radius=random.uniform(0.05, 0.2, len(points)),
        unit=unit,
        about=about,
    )


def shift(x: float, y: float, z: float) -> np.ndarray:
    matrix = np.eye(4)
    matrix[:3, 3] = (x, y, z)
    return matrix


class Reader:
    """Reads back what the writer promises."""

    def __init__(self, path: Path) -> None:
        self.document = pygltflib.GLTF2().load_binary(str(path))
        self.blob = self.document.binary_blob()
        self.parents = {c: i for i, n in enumerate(self.document.nodes) for c in n.children or ()}

    def array(self, accessor: int) -> np.ndarray:
        item = self.document.accessors[accessor]
        view = self.document.bufferViews[item.bufferView]
        width = WIDTHS[item.type]
        data = np.frombuffer(self.blob, TYPES[item.componentType], item.count * width, view.byteOffset)
        return data.reshape(-1, width).astype(np.float64) if width > 1 else data.astype(np.int64)

    def node(self, name: str) -> int:
        return next(i for i, n in enumerate(self.document.nodes) if n.name == name)

    def world(self, node: int) -> np.ndarray:
        matrix = self.document.nodes[node].matrix
        own = np.eye(4) if matrix is None else np.array(matrix).reshape(4, 4).T
        return self.world(self.parents[node]) @ own if node in self.parents else own

    def surface(self, name: str) -> tuple[np.ndarray, np.ndarray]:
        """World corners (m, 3, 3) and irradiance there, winding as a viewer sees it."""
        node = self.node(name)
        world = self.world(node)
        corners, values = [], []
        for primitive in self.document.meshes[self.document.nodes[node].mesh].primitives:
            triangles = self.array(primitive.indices).reshape(-1, 3)
            if np.linalg.det(world[:3, :3]) < 0:
                triangles = triangles[:, ::-1]
            points = self.array(primitive.attributes.POSITION) @ world[:3, :3].T + world[:3, 3]
            corners.append(points[triangles])
            values.append(self.array(primitive.attributes._IRRADIANCE)[triangles])
        return np.concatenate(corners), np.concatenate(values)
