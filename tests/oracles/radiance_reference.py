# SPDX-License-Identifier: Apache-2.0
"""Irradiance at points by Radiance's rtrace (PyPI package `pyradiance`): a second independent answer.

Radiance's lamps do not reflect, so the light that a lamp of ours would reflect is added to
its emission, from the irradiance that Radiance itself finds on the lamp.
"""

from __future__ import annotations

import importlib.util
import os
import resource
import subprocess
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from deltalux.scene import PointLight, Scene, SpotLight, SunLight
from numpy.typing import NDArray

from . import world

Array = NDArray[np.float64]

SPHERE_RADIUS = 1e-4  # metres, of the small sphere that stands for a point or spot light
SUN_ANGLE = 0.05  # degrees, full angle of the disc that stands for a sun
LAMP_POINTS = 64  # per lamp, where the light that it would reflect is asked for
LAMP_ROUNDS = 2  # of that question, as lamps light each other and themselves
SPOT_FUNCTION = """{ KHR_lights_punctual cone: A1..A3 axis, A4 cosine inner, A5 cosine outer }
khr_share = (-(Dx*A1 + Dy*A2 + Dz*A3) - A5) / (A4 - A5);
khr_spot = if(khr_share, if(1 - khr_share, khr_share*khr_share, 1), 0);
"""


class Unavailable(RuntimeError):
    """Radiance is not installed."""


@dataclass(frozen=True)
class Settings:
    """rtrace's rendering options, by their names there.

    The defaults are a path tracer without ambient cache; `aa` above 0 turns the cache on.
    Fewer than some 60 bounces (`ab`, `lr`) lose light: 0.4 % at a reflectance of 0.8 with 24.
    """

    ab: int = 100
    aa: float = 0.0
    ar: int = 0
    ad: int = 16
    as_: int = 0
    lw: float = 1e-2
    lr: int = -100
    ds: float = 0.1
    dj: float = 1.0
    dt: float = 0.0
    dc: float = 1.0

    def options(self) -> list[str]:
        """As rtrace takes them."""
        values = {name.rstrip("_"): value for name, value in vars(self).items()}
        return [text for name, value in values.items() for text in (f"-{name}", f"{value:g}")]


class Renderer:
    """A scene as a Radiance octree in a temporary folder.

    Parameters
    ----------
    scene : deltalux.Scene; movables stand where their meshes' poses put them
    lamp_settings : how the lamps' reflected light is found; None leaves it out
    """

    def __init__(self, scene: Scene, *, lamp_settings: Settings | None = Settings()) -> None:
        self._home = _package_folder()
        self._folder = tempfile.TemporaryDirectory(prefix="radiance-")
        self._lamps = [p for p in world.parts(scene) if p.material.emissive]
        self._scene = scene
        self._build([np.zeros(3) for _ in self._lamps])
        for _ in range(LAMP_ROUNDS if self._lamps and lamp_settings is not None else 0):
            self._build(self._reflected_by_lamps(lamp_settings))

    def irradiance(
        self, points: Array, normals: Array, settings: Settings, *, passes: int = 1
    ) -> world.Estimate:
        """Irradiance (n, 3); all passes in one process, each with other random numbers.

        More than one pass makes sense without ambient cache only.
        """
        rays = np.tile(np.concatenate([points, normals], axis=1), (passes, 1))
        command = ["rtrace", "-h", "-w-", "-I", "-u+", "-fdd", *settings.options(), "scene.oct"]
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        output = self._run(command, np.ascontiguousarray(rays).tobytes())
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        seconds = after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime
        values = np.frombuffer(output, np.float64).reshape(passes, len(points), 3)
        return world.estimate(values, seconds)

    def _build(self, extra: Sequence[Array]) -> None:
        """Write the scene and its octree; `extra` radiance is added to each lamp."""
        folder = Path(self._folder.name)
        (folder / "spot.cal").write_text(SPOT_FUNCTION)
        (folder / "scene.rad").write_text("\n".join(_description(self._scene, self._lamps, extra)) + "\n")
        (folder / "scene.oct").write_bytes(self._run(["oconv", "-w", "scene.rad"]))

    def _reflected_by_lamps(self, settings: Settings) -> list[Array]:
        """Radiance that each lamp's surface would reflect, its mean over the lamp."""
        rng = np.random.default_rng(1)
        chosen = [world.points_on(part.corners, LAMP_POINTS, rng) for part in self._lamps]
        points, normals = (np.concatenate(arrays) for arrays in zip(*chosen, strict=True))
        means = self.irradiance(points, normals, settings).mean.reshape(-1, LAMP_POINTS, 3).mean(axis=1)
        return [p.material.reflectance * mean / np.pi for p, mean in zip(self._lamps, means, strict=True)]

    def _run(self, command: Sequence[str], stdin: bytes = b"") -> bytes:
        environment = os.environ | {"RAYPATH": f".:{self._home / 'lib'}"}
        program = str(self._home / "bin" / command[0])
        result = subprocess.run(
            [program, *command[1:]], input=stdin, capture_output=True, cwd=self._folder.name, env=environment
        )
        if result.returncode:
            raise RuntimeError(f"{' '.join(command)}: {result.stderr.decode(errors='replace')[:500]}")
        return result.stdout


def _package_folder() -> Path:
    spec = importlib.util.find_spec("pyradiance")
    if spec is None or spec.origin is None:
        raise Unavailable("pyradiance: not installed; pip install pyradiance")
    return Path(spec.origin).parent


def _description(scene: Scene, lamps: Sequence[world.Part], extra: Sequence[Array]) -> list[str]:
    """The scene in Radiance's language, one primitive a line."""
    lines = []
    surfaces = [part for part in world.parts(scene) if not part.material.emissive]
    for i, part in enumerate(surfaces):
        lines.append(f"void plastic m{i} 0 0 5 {_text(part.material.reflectance)} 0 0")
        lines += [f"m{i} polygon s{i}.{j} 0 0 9 {_text(t)}" for j, t in enumerate(part.corners)]
    for i, (part, more) in enumerate(zip(lamps, extra, strict=True)):
        lines.append(f"void light l{i} 0 0 3 {_text(part.material.emission + more)}")
        for k, side in enumerate(world.emitting_sides(part)):
            for j, face in enumerate(merge_triangles(side)):
                lines.append(f"l{i} polygon e{i}.{k}.{j} 0 0 {3 * len(face)} {_text(face)}")
    for i, light in enumerate(world.lights(scene)):
        lines += _light(f"p{i}", light)
    return lines


def _light(name: str, light: PointLight | SpotLight | SunLight) -> list[str]:
    if isinstance(light, SunLight):
        solid_angle = np.pi * np.sin(np.radians(SUN_ANGLE / 2)) ** 2
        return [
            f"void light {name} 0 0 3 {_text(light.irradiance / solid_angle)}",
            f"{name} source {name}.s 0 0 4 {_text(-light.direction)} {SUN_ANGLE}",
        ]
    lines, modifier = [], "void"
    if isinstance(light, SpotLight):
        modifier = f"{name}.cone"
        cosines = np.cos([light.inner_angle, light.outer_angle])
        lines.append(
            f"void brightfunc {modifier} 2 khr_spot spot.cal 0 5 {_text(light.direction)} {_text(cosines)}"
        )
    radiance = light.intensity / (np.pi * SPHERE_RADIUS**2)
    return [
        *lines,
        f"{modifier} light {name} 0 0 3 {_text(radiance)}",
        f"{name} sphere {name}.s 0 0 4 {_text(light.position)} {SPHERE_RADIUS}",
    ]


def merge_triangles(corners: Array) -> list[Array]:
    """Faces for the lamps: each two successive triangles that form a plane convex quad become one.

    Radiance treats every face of a lamp as a light of its own and likes rectangles best.
    """
    faces: list[Array] = []
    i = 0
    while i < len(corners):
        quad = _quad(corners[i], corners[i + 1]) if i + 1 < len(corners) else None
        faces.append(corners[i] if quad is None else quad)
        i += 1 if quad is None else 2
    return faces


def _quad(first: Array, second: Array) -> Array | None:
    """The quad of two triangles that share an edge; None where it is not plane and convex."""
    tolerance = 1e-6 * np.abs(np.stack([first, second])).max()
    same = np.linalg.norm(first[:, None] - second[None], axis=2) <= tolerance
    if same.sum() != 2:
        return None
    apart = int(np.flatnonzero(~same.any(axis=1))[0])
    other = second[~same.any(axis=0)][0]
    quad = np.stack([first[apart], first[(apart + 1) % 3], other, first[(apart + 2) % 3]])
    edges = np.roll(quad, -1, axis=0) - quad
    turns = np.cross(edges, np.roll(edges, -1, axis=0))
    normal = np.cross(first[1] - first[0], first[2] - first[0])
    normal /= np.linalg.norm(normal)
    plane = abs((other - first[0]) @ normal) <= tolerance
    return quad if plane and (turns @ normal > 0).all() else None


def _text(values: Array) -> str:
    return " ".join(f"{value:.9g}" for value in np.ravel(values))
