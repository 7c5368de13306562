# SPDX-License-Identifier: Apache-2.0
"""Scenes as users write them: meshes, materials and lights over NumPy arrays."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from inspect import signature
from typing import Any

import numpy as np

from deltalux.errors import OptionError, SceneError
from deltalux.units import UNITS, photopic
from deltalux.vectors import triangle_areas

from .arrays import frozen_array
from .cameras import Camera
from .emitting_areas import emitting_areas
from .frame import SceneFrame, coarse_places, scene_frame
from .lights import Light
from .look import PLAIN, Look, checked_coordinates
from .naming import candidates, chosen
from .nodes import Node
from .outward_light import inner_shares
from .surfaces import DIFFUSE, Surface

MAX_GROUPS = 8  # up to this many groups, the core keeps sums per group (see "Group" in the glossary)


def rigid_pose(pose: Any, what: str = "pose") -> np.ndarray:
    """Check that `pose` is a rigid 4x4 matrix (local to world, column vectors)."""
    try:
        matrix = frozen_array(pose, np.float64, (4, 4), what)
    except SceneError as error:
        raise OptionError(str(error)) from None
    rotation = matrix[:3, :3]
    bounded = np.abs(rotation).max() < 2  # else products could overflow
    orthonormal = bounded and np.abs(rotation.T @ rotation - np.eye(3)).max() < 1e-4
    if not orthonormal or np.linalg.det(rotation) < 0 or np.any(matrix[3] != (0, 0, 0, 1)):
        raise OptionError(
            f"{what}: found a matrix that scales, shears or mirrors, expected a rigid one "
            "(rotation and translation); bake scale into the mesh's vertices"
        )
    return matrix


@dataclass(frozen=True, eq=False)
class Material:
    """What a mesh is made of: it reflects light, and may be luminous.

    Parameters
    ----------
    name : str
    reflectance : 3 floats in [0, 1], linear RGB; the mean where it differs from point to point
    emission : 3 floats, radiance (W/(sr m2)) or luminance (cd/m2) per channel, front side
    group : light group of the emission; None = the name of the mesh that carries it
    two_sided : emit from both sides
    look : textures, and transparency as a file has it
    surface : how it scatters light; diffuse by default
    """

    name: str
    reflectance: Any = (0.5, 0.5, 0.5)
    emission: Any = (0.0, 0.0, 0.0)
    group: str | None = None
    two_sided: bool = False
    look: Look = PLAIN
    surface: Surface = DIFFUSE

    def __post_init__(self) -> None:
        what = f'material "{self.name}"'
        reflectance = frozen_array(self.reflectance, np.float64, (3,), f"{what}: reflectance")
        emission = frozen_array(self.emission, np.float64, (3,), f"{what}: emission")
        if (reflectance < 0).any() or (reflectance > 1).any():
            raise SceneError(f"{what}: reflectance: found {reflectance}, expected 0 to 1 per channel")
        if (emission < 0).any():
            raise SceneError(f"{what}: emission: found {emission}, expected no negative channel")
        object.__setattr__(self, "reflectance", reflectance)
        object.__setattr__(self, "emission", emission)

    @property
    def emissive(self) -> bool:
        """Whether the material emits light."""
        return bool((self.emission > 0).any())


@dataclass(frozen=True, eq=False)
class Mesh:
    """Triangles with a pose; static unless `movable`.

    Parameters
    ----------
    name : str
        Unique in the scene; what `Session.move` and `--movable` refer to.
    vertices : (n, 3) float array, local, metres
    triangles : (m, 3) int array; the front side is counter-clockwise
    material : str or sequence of str
        One name for all triangles, or several with `material_index`.
    material_index : (m,) int array or None
        For each triangle, an index into `material` if `material` is a sequence.
    pose : 4x4 rigid matrix, local to world
    movable : bool
    smooth_angle : float
        Vertices are shaded smoothly where faces meet at a smaller angle than this, degrees.
    coordinates : (m, 3, 2) float32 array or None
        Texture coordinates of each triangle's corners, NaN where there are none, for surfaces that read
        them and for outputs.
    """

    name: str
    vertices: Any
    triangles: Any
    material: str | Sequence[str] = "default"
    material_index: Any = None
    pose: Any = field(default_factory=lambda: np.eye(4))
    movable: bool = False
    smooth_angle: float = 35.0
    coordinates: Any = None

    def __post_init__(self) -> None:
        what = f'mesh "{self.name}"'
        vertices = frozen_array(self.vertices, np.float64, (-1, 3), f"{what}: vertices")
        triangles = frozen_array(self.triangles, np.int64, (-1, 3), f"{what}: triangles")
        if triangles.size and (triangles.min() < 0 or triangles.max() >= len(vertices)):
            bad = int(triangles.max() if triangles.max() >= len(vertices) else triangles.min())
            raise SceneError(
                f"{what}: triangles: found vertex index {bad}, expected 0 to {len(vertices) - 1}"
            )
        if vertices.size and np.abs(vertices).max() > 1e9:
            raise SceneError(f"{what}: vertices: found a coordinate beyond 1e9 m, expected a scene in metres")
        names = (self.material,) if isinstance(self.material, str) else tuple(self.material)
        index = np.zeros(len(triangles), np.int64) if self.material_index is None else self.material_index
        index = frozen_array(index, np.int64, (len(triangles),), f"{what}: material_index")
        if index.size and (index.min() < 0 or index.max() >= len(names)):
            raise SceneError(
                f"{what}: material_index: found {int(index.max())}, expected 0 to {len(names) - 1}"
            )
        if self.coordinates is not None:
            found = checked_coordinates(self.coordinates, len(triangles), what)
            object.__setattr__(self, "coordinates", found)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "triangles", triangles)
        object.__setattr__(self, "material", names)
        object.__setattr__(self, "material_index", index)
        object.__setattr__(self, "pose", rigid_pose(self.pose, f"{what}: pose"))

    @property
    def world_vertices(self) -> np.ndarray:
        """(n, 3) float64 vertices in world space, in the mesh's initial pose."""
        return self.vertices @ self.pose[:3, :3].T + self.pose[:3, 3]

    def triangle_areas(self) -> np.ndarray:
        """(m,) float64 areas, square metres."""
        return triangle_areas(self.vertices[self.triangles])


class Scene:
    """Meshes, materials and lights; immutable.

    Parameters
    ----------
    meshes : Mesh sequence, names unique
    materials : Material sequence; meshes refer to them by name
    lights : PointLight, SpotLight, SunLight sequence
    unit : "W/m2" or "lux", the unit of every result
    cameras, nodes, warnings : further content of the file that a loader read
    source : path of the file that the scene was read from; absolute if a loader or a session gives it
    files : paths of all files that the scene was read from; no output overwrites one of them
    frame : frame of the scene that this one is derived from; reused if it still applies

    Raises
    ------
    SceneError
        If names clash or refer to nothing, or an array is malformed.
    """

    def __init__(
        self,
        meshes: Iterable[Mesh],
        materials: Iterable[Material] = (),
        lights: Iterable[Light] = (),
        *,
        unit: str = "W/m2",
        cameras: Iterable[Camera] = (),
        nodes: Iterable[Node] = (),
        warnings: Iterable[str] = (),
        source: str | None = None,
        files: Iterable[str] = (),
        frame: SceneFrame | None = None,
    ) -> None:
        self.meshes = tuple(meshes)
        self.materials = tuple(materials)
        self.lights = tuple(lights)
        self.cameras = tuple(cameras)
        self.nodes = tuple(nodes)
        self.frame = scene_frame(self.meshes, frame)
        self.warnings = tuple(dict.fromkeys([*warnings, *coarse_places(self.meshes, self.frame)]))
        self.source = source
        self.files = tuple(files) or (() if source is None else (source,))
        if unit not in UNITS:
            raise OptionError(f"unit: found {unit!r}, expected one of {UNITS}")
        self.unit = unit
        self._emissive = {m.name: i for i, m in enumerate(self.materials) if m.emissive}
        self._check_names()

    def _check_names(self) -> None:
        for kind, items in (("mesh", self.meshes), ("material", self.materials), ("light", self.lights)):
            seen: set[str] = set()
            for item in items:
                if item.name in seen:
                    raise SceneError(f'{kind} "{item.name}": found twice, expected unique names')
                seen.add(item.name)
        materials = {m.name for m in self.materials}
        movable = {m.name for m in self.meshes if m.movable}
        for mesh in self.meshes:
            for name in mesh.material:
                if name not in materials:
                    raise SceneError(
                        f'mesh "{mesh.name}": material "{name}" is not in the scene; '
                        f"found {sorted(materials)[:8]}"
                    )
        for light in self.lights:
            if light.attached_to is not None and light.attached_to not in movable:
                raise SceneError(
                    f'light "{light.name}": attached to "{light.attached_to}", '
                    f"which is no movable mesh; movable are {sorted(movable)}"
                )

    @property
    def movable(self) -> tuple[str, ...]:
        """Names of the movable meshes."""
        return tuple(m.name for m in self.meshes if m.movable)

    def mesh(self, name: str) -> Mesh:
        """The mesh of that name; OptionError if there is none."""
        for mesh in self.meshes:
            if mesh.name == name:
                return mesh
        raise OptionError(f'mesh "{name}": not in the scene; found {[m.name for m in self.meshes][:12]}')

    def material(self, name: str) -> Material:
        """The material of that name; OptionError if there is none."""
        for material in self.materials:
            if material.name == name:
                return material
        found = [m.name for m in self.materials][:12]
        raise OptionError(f'material "{name}": not in the scene; found {found}')

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """World bounds (minimum, maximum), each (3,)."""
        used = [m.world_vertices[np.unique(m.triangles)] for m in self.meshes if len(m.triangles)]
        if not used:
            return np.zeros(3), np.zeros(3)
        points = np.concatenate(used)
        return points.min(axis=0), points.max(axis=0)

    @property
    def groups(self) -> tuple[str, ...]:
        """Names of the light groups: of lights, then of meshes, so that those of another mesh come last."""
        names = dict.fromkeys(light.group or light.name for light in self.lights)
        for mesh in self.meshes:
            names |= dict.fromkeys(self.groups_of(mesh))
        return tuple(names)

    def groups_of(self, mesh: Mesh) -> tuple[str, ...]:
        """Names of the light groups that a mesh of these materials emits in."""
        return tuple(dict.fromkeys(m.group or mesh.name for m in self._emissive_materials(mesh)))

    def _emissive_materials(self, mesh: Mesh) -> list[Material]:
        used = {mesh.material[i] for i in np.unique(mesh.material_index)}
        return [self.materials[i] for i in sorted(self._emissive[n] for n in used & self._emissive.keys())]

    def with_mesh(self, mesh: Mesh) -> Scene:
        """A copy with one more mesh."""
        return replace_scene(self, meshes=(*self.meshes, mesh))

    def info(self) -> Mapping[str, Any]:
        """Counts, bounds, lights with total power, movables and warnings.

        Returns
        -------
        dict with `triangles`, `area`, `emissive_area`, `bounds`, `lights` (name, kind, group,
        power in watts or lumens, photopic; of two-sided surfaces what leaves the body that they are part of),
        `movable`, `unit`, `materials`, `warnings`.
        """
        by_name = {m.name: m for m in self.materials}
        triangles, area, emissive_area = 0, 0.0, 0.0
        lights: list[dict[str, Any]] = []
        emitting = emitting_areas(self, [mesh for mesh in self.meshes if self._emissive_materials(mesh)])
        for mesh in self.meshes:
            areas = mesh.triangle_areas()
            triangles += len(areas)
            area += float(areas.sum())
            seen = emitting.get(mesh.name, areas)
            # The core reckons in single precision; where nothing hides a triangle, its area is known better.
            areas = np.where(np.isclose(seen, areas, rtol=1e-3, atol=0), areas, seen)
            emissive = self._emissive_materials(mesh)
            backs = np.zeros_like(areas)
            if any(material.two_sided for material in emissive):
                backs = areas * inner_shares(mesh.vertices, mesh.triangles)
            for material in emissive:
                uses = self._uses(mesh, material.name)
                own = float(areas[uses].sum())
                emissive_area += own
                shining = own
                if material.two_sided:
                    shining += float(backs[uses].sum())
                power = np.pi * shining * material.emission
                lights.append(
                    {
                        "name": mesh.name,
                        "kind": "area",
                        "group": material.group or mesh.name,
                        "power": float(photopic(power)),
                        "area": own,
                    }
                )
        for light in self.lights:
            entry = {"name": light.name, "kind": light.kind, "group": light.group or light.name}
            lights.append(entry | {"power": light.power()})
        low, high = self.bounds
        return {
            "triangles": triangles,
            "area": area,
            "emissive_area": emissive_area,
            "bounds": [low.tolist(), high.tolist()],
            "meshes": len(self.meshes),
            "materials": len(by_name),
            "lights": lights,
            "cameras": [c.name for c in self.cameras],
            "movable": list(self.movable),
            "unit": self.unit,
            "warnings": list(self.warnings),
        }

    @staticmethod
    def _uses(mesh: Mesh, material: str) -> np.ndarray:
        index = [i for i, name in enumerate(mesh.material) if name == material]
        return np.isin(mesh.material_index, index)

    def __repr__(self) -> str:
        count = sum(len(m.triangles) for m in self.meshes)
        return (
            f"Scene({len(self.meshes)} meshes, {count} triangles, "
            f"{len(self.groups)} light groups, movable {list(self.movable)}, unit {self.unit!r})"
        )


def replace_scene(scene: Scene, **changes: Any) -> Scene:
    """A copy of `scene` with some constructor arguments replaced."""
    return Scene(**({key: getattr(scene, key) for key in signature(Scene).parameters} | changes))


def make_movable(scene: Scene, names: Iterable[str]) -> Scene:
    """A copy in which the meshes `names` are movable; ``*``, ``?`` and ``[...]`` describe several.

    Raises OptionError if a name matches no mesh.
    """
    present = [mesh.name for mesh in scene.meshes]
    wanted: set[str] = set()
    for name in names:
        found = chosen(name, present)
        if not found:
            raise OptionError(f'mesh "{name}": not in the scene; found {candidates(name, present)}')
        wanted.update(found)
    meshes = [replace(m, movable=True) if m.name in wanted else m for m in scene.meshes]
    return replace_scene(scene, meshes=meshes)
