# SPDX-License-Identifier: Apache-2.0
"""A scene's triangles and lights in world space, as the other renderers want them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from deltalux.scene import Light, Material, PointLight, Scene, SpotLight, SunLight, replace_scene
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]

TWO_SIDED_OFFSET = 1e-4  # metres between the faces of a lamp that emits from both sides


@dataclass(frozen=True)
class Estimate:
    """Means and their standard errors, each (n, 3), from independent passes; CPU seconds spent."""

    mean: Array
    standard_error: Array
    cpu_seconds: float


def estimate(passes: Array, cpu_seconds: float) -> Estimate:
    """Mean and standard error of the mean over the first axis of `passes` (k, n, 3)."""
    count = len(passes)
    error = passes.std(axis=0, ddof=1) / np.sqrt(count) if count > 1 else np.full(passes.shape[1:], np.nan)
    return Estimate(passes.mean(axis=0), error, cpu_seconds)


@dataclass(frozen=True)
class Part:
    """The triangles of one mesh that share one material: corners (n, 3, 3), in world space."""

    mesh: str
    material: Material
    corners: Array
    movable: bool


def parts(scene: Scene) -> Iterator[Part]:
    """Every mesh by material, degenerate triangles left out."""
    materials = {m.name: m for m in scene.materials}
    for mesh in scene.meshes:
        corners = mesh.world_vertices[mesh.triangles]
        real = mesh.triangle_areas() > 0
        for index, name in enumerate(mesh.material):
            own = corners[real & (mesh.material_index == index)]
            if len(own):
                yield Part(mesh.name, materials[name], own, mesh.movable)


def emitting_sides(part: Part) -> list[Array]:
    """Corners (n, 3, 3) of faces that emit from the front only, as the other renderers' do.

    A two-sided lamp gets a reversed copy close behind it.
    """
    if not part.material.two_sided:
        return [part.corners]
    normals = np.cross(part.corners[:, 1] - part.corners[:, 0], part.corners[:, 2] - part.corners[:, 0])
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    return [part.corners, part.corners[:, ::-1] - TWO_SIDED_OFFSET * normals[:, None]]


def lights(scene: Scene) -> list[Light]:
    """Punctual lights, those attached to a movable brought to world space."""
    return [_in_world(light, scene) for light in scene.lights]


def _in_world(light: Light, scene: Scene) -> Light:
    if light.attached_to is None:
        return light
    pose = scene.mesh(light.attached_to).pose
    rotation, origin = pose[:3, :3], pose[:3, 3]
    if isinstance(light, PointLight):
        return PointLight(light.name, rotation @ light.position + origin, light.intensity)
    if isinstance(light, SpotLight):
        return SpotLight(
            light.name, rotation @ light.position + origin, rotation @ light.direction,
            light.intensity, light.inner_angle, light.outer_angle,
        )  # fmt: skip
    return SunLight(light.name, rotation @ light.direction, light.irradiance)


def moved(scene: Scene, name: str, translation: tuple[float, float, float], degrees: float = 0.0) -> Scene:
    """A copy of `scene` with the movable `name` shifted, metres, and turned about its own +y."""
    pose = scene.mesh(name).pose.copy()
    if degrees:
        cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
        pose[:3, :3] = pose[:3, :3] @ np.array([(cos, 0, sin), (0, 1, 0), (-sin, 0, cos)])
    pose[:3, 3] += translation
    meshes = [replace(mesh, pose=pose) if mesh.name == name else mesh for mesh in scene.meshes]
    return replace_scene(scene, meshes=meshes)


def scene_hash(scene: Scene) -> str:
    """Hex digest of all that light depends on; equal for scenes that are equal but for rounding."""
    digest = hashlib.sha256()
    for part in parts(scene):
        material = part.material
        digest.update(part.mesh.encode())
        digest.update(bytes([part.movable, material.two_sided]))
        for array in (part.corners, material.reflectance, material.emission):
            rounded = np.round(array, 6) + 0.0  # micrometres, and no negative zero
            digest.update(rounded.astype(np.float32).tobytes())
    for light in lights(scene):
        digest.update(repr(light).encode())
    return digest.hexdigest()[:16]


def area_points(
    scene: Scene,
    count: int,
    seed: int,
    *,
    offset: float = 1e-4,
    near: Array | None = None,
    within: float = 0.0,
) -> tuple[Array, Array]:
    """Points uniform over the area of the static surfaces, on their front side.

    Parameters
    ----------
    offset : distance off the surface, metres
    near, within : keep only points at most `within` metres from one of the points `near` (k, 3)

    Returns
    -------
    points, normals : (count, 3); the first of a longer call are those of a shorter one.
    """
    corners = np.concatenate([part.corners for part in parts(scene) if not part.movable])
    rng = np.random.default_rng(seed)
    tree = None if near is None else cKDTree(near)
    found: list[tuple[Array, Array]] = []
    while sum(len(p) for p, _ in found) < count:
        points, normals = points_on(corners, 4096, rng, offset)  # fixed blocks: longer calls extend shorter
        if tree is not None:
            close = tree.query(points)[0] <= within
            points, normals = points[close], normals[close]
        found.append((points, normals))
    points, normals = (np.concatenate(arrays)[:count] for arrays in zip(*found, strict=True))
    return points, normals


def points_on(
    corners: Array, count: int, rng: np.random.Generator, offset: float = 1e-4
) -> tuple[Array, Array]:
    """Points (count, 3) uniform over triangles (n, 3, 3), `offset` metres before them, and normals."""
    cross = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    twice_area = np.linalg.norm(cross, axis=1)
    share = np.cumsum(twice_area) / twice_area.sum()
    u = rng.random((count, 3))
    index = np.searchsorted(share, u[:, 0], side="right").clip(max=len(share) - 1)
    root = np.sqrt(u[:, 1])
    weights = np.stack([1 - root, root * (1 - u[:, 2]), root * u[:, 2]], axis=1)
    normals = cross[index] / twice_area[index, None]
    return np.einsum("ij,ijk->ik", weights, corners[index]) + offset * normals, normals
