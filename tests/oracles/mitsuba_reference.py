# SPDX-License-Identifier: Apache-2.0
"""Irradiance at points by Mitsuba 3: an answer that shares no code with Deltalux.

The radiance that arrives at a point comes from Mitsuba's own `path` integrator along
cosine-distributed directions; light that arrives straight from a lamp is combined with
Mitsuba's emitter sampling by the balance heuristic. Needs the PyPI package `mitsuba`; its
variant LLVM, for more than some ten thousand paths, also a shared LLVM library (Debian and
Ubuntu: libllvm19).
"""

from __future__ import annotations

import functools
import os
import re
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from deltalux.scene import PaneSurface, PointLight, Scene, SpotLight, SunLight
from numpy.typing import NDArray

from . import world

Array = NDArray[np.float64]

LLVM, SCALAR = "llvm_ad_rgb", "scalar_rgb"  # variants: many paths at once, or one after another
OLDEST_LLVM = 17  # older ones abort on Dr.Jit's llvm.minimum
SEEDS = 1 << 10  # apart are the seeds of blocks of points and of calls; limits passes and blocks
LANES = 1 << 20  # paths per kernel launch: enough to fill the machine, 1 to 2 GB


class Unavailable(RuntimeError):
    """Mitsuba or the LLVM library that its variant needs is not installed."""


def load(threads: int = 1, variant: str = LLVM) -> Any:
    """Mitsuba with that variant set; `Unavailable` names what is missing."""
    if variant == LLVM:
        os.environ.setdefault("DRJIT_LIBLLVM_PATH", _newest_llvm())
    try:
        import drjit
        import mitsuba
    except ImportError as error:
        raise Unavailable(f"mitsuba: {error}; pip install mitsuba") from None
    mitsuba.set_variant(variant)
    drjit.set_thread_count(threads)
    return mitsuba


def _newest_llvm() -> str:
    """Path of the newest LLVM library (libLLVM-17.so, libLLVM.so.19.1, ...)."""
    folders = ("usr/lib/*-linux-gnu", "usr/lib64", "usr/lib", "usr/lib/llvm-*/lib", "usr/local/lib")
    found: list[tuple[int, str]] = []
    for path in (str(p) for folder in folders for p in Path("/").glob(f"{folder}/libLLVM*.so*")):
        match = re.search(r"libLLVM(?:-|\.so\.)(\d+)", path)
        if match:
            found.append((int(match[1]), path))
    version, path = max(found, default=(0, ""))
    if version < OLDEST_LLVM:
        raise Unavailable(
            f"LLVM: found version {version or 'none'}, expected {OLDEST_LLVM} or newer for Mitsuba; "
            "apt-get install libllvm19"
        )
    return path


class Renderer:
    """A scene in Mitsuba, ready to be asked for irradiance.

    Parameters
    ----------
    scene : deltalux.Scene; movables stand where their meshes' poses put them
    threads : worker threads; 1 for CPU time
    sampler : Mitsuba's name of the sampler. "multijitter" has half the variance, but a bias at
        few samples a pass (2 % at 4, 1 % at 16, none seen from 64, in a bright closed room)
    variant : LLVM or SCALAR
    """

    def __init__(
        self, scene: Scene, *, threads: int = 1, sampler: str = "independent", variant: str = LLVM
    ) -> None:
        self._threads, self._variant = threads, variant
        self._mi = load(threads, variant)
        self._scene = self._mi.load_dict(_scene_dict(self._mi, scene))
        self._integrator = self._mi.load_dict({"type": "path", "max_depth": -1, "rr_depth": 3})
        self._sampler_name = sampler

    def irradiance(
        self, points: Array, normals: Array, samples_per_point: int, *, passes: int = 16, seed: int = 1
    ) -> world.Estimate:
        """Irradiance (n, 3) at points that lie off the surfaces, on the side of their normals.

        Parameters
        ----------
        samples_per_point : paths per point, all told; rounded up to whole passes
        passes : independent parts, whose spread gives the standard error
        """
        before = time.process_time()
        values = self.passes(points, normals, samples_per_point, passes=passes, seed=seed)
        return world.estimate(values, time.process_time() - before)

    def passes(
        self, points: Array, normals: Array, samples_per_point: int, *, passes: int = 16, seed: int = 1
    ) -> Array:
        """The passes (k, n, 3) whose mean `irradiance` returns.

        Equal seeds give equal random numbers at each point, so that the difference of two
        scenes that differ little has little noise.
        """
        load(self._threads, self._variant)  # a renderer made later may have set another
        sampler = self._sampler(max(1, -(-samples_per_point // passes)))
        block = max(1, LANES // sampler.sample_count())
        blocks = []
        for number, start in enumerate(range(0, len(points), block)):
            part = slice(start, start + block)
            first = (seed * SEEDS + number) * SEEDS
            seeds = range(first, first + passes)
            one_pass = self._pass if self._variant == LLVM else self._scalar_pass
            blocks.append(np.stack([one_pass(points[part], normals[part], sampler, k) for k in seeds]))
        return np.concatenate(blocks, axis=1)

    def free_share(self, points: Array, normals: Array, distances: Sequence[float], rays: int = 256) -> Array:
        """Share (n, len(distances)) of cosine-distributed rays that meet nothing for that far.

        It is near 0 in the slit behind a picture or under a cupboard, which nobody sees.
        """
        mi = self._mi
        numbers = np.random.default_rng(0).random((2, len(points) * rays))
        frame = mi.Frame3f(mi.Normal3f(np.repeat(normals, rays, axis=0).T.astype(np.float32)))
        local = mi.warp.square_to_cosine_hemisphere(mi.Point2f(numbers.astype(np.float32)))
        origin = mi.Point3f(np.repeat(points, rays, axis=0).T.astype(np.float32))
        hit = self._scene.ray_intersect(mi.Ray3f(origin, frame.to_world(local)))
        reach = np.asarray(hit.t, np.float64).reshape(len(points), rays)
        return np.stack([(reach > distance).mean(axis=1) for distance in distances], axis=1)

    def _sampler(self, count: int) -> Any:
        """A sampler of `count` numbers per point, or of the next count that it can stratify."""
        description = {"type": self._sampler_name, "sample_count": count}
        self._mi.set_log_level(self._mi.LogLevel.Error)  # it warns when it rounds up
        sampler = self._mi.load_dict(description)
        self._mi.set_log_level(self._mi.LogLevel.Warn)
        if self._variant == LLVM:
            sampler.set_samples_per_wavefront(sampler.sample_count())
        return sampler

    def _pass(self, points: Array, normals: Array, sampler: Any, seed: int) -> Array:
        """Means over one path per number of the sampler from each point."""
        import drjit as dr

        mi, count = self._mi, sampler.sample_count()
        lanes = len(points) * count
        sampler.seed(seed, lanes)
        index = dr.arange(mi.UInt32, lanes) // count
        here = dr.zeros(mi.SurfaceInteraction3f, lanes)
        here.p = dr.gather(mi.Point3f, mi.Point3f(points.T.astype(np.float32)), index)
        here.n = dr.gather(mi.Normal3f, mi.Normal3f(normals.T.astype(np.float32)), index)
        here.sh_frame = mi.Frame3f(here.n)
        total = self._estimate(sampler, here)
        per_point = [dr.block_sum(channel, count) / count for channel in (total.x, total.y, total.z)]
        return np.stack([np.asarray(channel, np.float64) for channel in per_point], axis=1)

    def _scalar_pass(self, points: Array, normals: Array, sampler: Any, seed: int) -> Array:
        """As `_pass`, path by path; each has its own seed, so that no path shifts another's numbers."""
        mi, count = self._mi, sampler.sample_count()
        seeds = np.random.default_rng(seed).integers(1 << 32, size=(len(points), count))
        total = np.zeros((len(points), 3))
        here = mi.SurfaceInteraction3f()
        for i, (point, normal) in enumerate(zip(points.tolist(), normals.tolist(), strict=True)):
            here.p, here.n = mi.Point3f(point), mi.Normal3f(normal)
            here.sh_frame = mi.Frame3f(here.n)
            for own in seeds[i].tolist():
                sampler.seed(own)
                total[i] += self._estimate(sampler, here)
        return total / count

    def _estimate(self, sampler: Any, here: Any) -> Any:
        """Irradiance by one path from each place."""
        return self._sample_emitter(sampler, here) + self._sample_direction(sampler, here)

    def _sample_emitter(self, sampler: Any, here: Any) -> Any:
        """Light from a sampled point of a lamp, with its balance-heuristic weight."""
        import drjit as dr

        mi = self._mi
        sample, light = self._scene.sample_emitter_direction(here, sampler.next_2d(), True)
        cosine = dr.maximum(dr.dot(here.n, sample.d), 0)
        weight = dr.select(sample.delta, 1, sample.pdf / (sample.pdf + cosine * dr.inv_pi))
        return dr.select((cosine > 0) & (sample.pdf > 0), light * cosine * weight, mi.Color3f(0))

    def _sample_direction(self, sampler: Any, here: Any) -> Any:
        """Radiance along a cosine-distributed direction; lamps met at once keep their share only."""
        import drjit as dr

        mi, scene = self._mi, self._scene
        local = mi.warp.square_to_cosine_hemisphere(sampler.next_2d())
        ray = mi.RayDifferential3f(mi.Ray3f(here.p, here.sh_frame.to_world(local)))
        radiance, _, _ = self._integrator.sample(scene, sampler, ray)
        hit = scene.ray_intersect(ray)
        emitter = hit.emitter(scene)
        if emitter is None:  # a scalar: in arrays those without are zeros
            return dr.pi * radiance
        emitted = emitter.eval(hit)
        pdf_emitter = scene.pdf_emitter_direction(here, mi.DirectionSample3f(scene, hit, here))
        pdf_direction = mi.warp.square_to_cosine_hemisphere_pdf(local)
        counted_elsewhere = pdf_emitter / (pdf_emitter + pdf_direction)
        return dr.pi * (radiance - emitted * dr.select(dr.isfinite(counted_elsewhere), counted_elsewhere, 0))


def change(
    before: Renderer,
    after: Renderer,
    points: Array,
    normals: Array,
    samples_per_point: int,
    *,
    passes: int = 16,
    seed: int = 1,
) -> world.Estimate:
    """What an edit changed, E after - E before (n, 3), from equal random numbers on both sides."""
    start = time.process_time()
    old, new = (
        renderer.passes(points, normals, samples_per_point, passes=passes, seed=seed)
        for renderer in (before, after)
    )
    return world.estimate(new - old, time.process_time() - start)


def _scene_dict(mi: Any, scene: Scene) -> dict[str, Any]:
    """The scene as Mitsuba's dictionary: one mesh per lamp, one per material for the rest."""
    description: dict[str, Any] = {"type": "scene"}
    plain: dict[str, list[world.Part]] = {}
    for i, part in enumerate(world.parts(scene)):
        if not part.material.emissive:
            plain.setdefault(part.material.name, []).append(part)
            continue
        for j, corners in enumerate(world.emitting_sides(part)):
            description[f"lamp_{i}_{j}"] = _mesh(mi, f"lamp_{i}_{j}", corners, part.material)
    for i, parts in enumerate(plain.values()):
        corners = np.concatenate([part.corners for part in parts])
        description[f"mesh_{i}"] = _mesh(mi, f"mesh_{i}", corners, parts[0].material)
    for i, light in enumerate(world.lights(scene)):
        description[f"light_{i}"] = _light(mi, light)
    return description


def _mesh(mi: Any, name: str, corners: Array, material: Any) -> Any:
    properties = mi.Properties()
    properties["mesh_bsdf"] = mi.load_dict(_bsdf(material))
    if material.emissive:
        radiance = {"type": "rgb", "value": material.emission.tolist()}
        properties["mesh_emitter"] = mi.load_dict({"type": "area", "radiance": radiance})
    mesh = mi.Mesh(name, 3 * len(corners), len(corners), properties)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = corners.ravel().astype(np.float32)
    parameters["faces"] = np.arange(3 * len(corners), dtype=np.uint32)
    parameters.update()
    return mesh


def _bsdf(material: Any) -> dict[str, Any]:
    """Of a diffuse surface; of a pane without a tint that is all diffuse, or all glass.

    Mitsuba's thin glass is a plate that absorbs nothing. It averages both polarisations before the
    reflections between the faces, which passes up to 1 % less at 60 degrees.
    """
    reflectance = {"type": "rgb", "value": material.reflectance.tolist()}
    plain = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": reflectance}}
    pane = material.surface
    if not isinstance(pane, PaneSurface):
        return plain
    glass = {"type": "thindielectric", "int_ior": pane.index, "ext_ior": 1.0}
    return {"type": "mask", "opacity": pane.coverage, "bsdf": glass if pane.transmission else plain}


def _light(mi: Any, light: Any) -> dict[str, Any]:
    """A point, spot or sun."""

    def rgb(value: Array) -> dict[str, Any]:
        return {"type": "rgb", "value": value.tolist()}

    if isinstance(light, SunLight):
        direction = light.direction.tolist()
        return {"type": "directional", "direction": direction, "irradiance": rgb(light.irradiance)}
    if isinstance(light, PointLight):
        return {"type": "point", "position": light.position.tolist(), "intensity": rgb(light.intensity)}
    assert isinstance(light, SpotLight)
    _register_spot(mi, mi.variant())
    return {
        "type": "khr_spot",
        "origin": light.position.tolist(),
        "axis": light.direction.tolist(),
        "intensity": light.intensity.tolist(),
        "cosines": [np.cos(light.inner_angle), np.cos(light.outer_angle), 0],
    }


@functools.cache
def _register_spot(mi: Any, variant: str) -> None:
    """Teach Mitsuba the cone falloff of KHR_lights_punctual; its own spot falls off otherwise."""
    import drjit as dr

    class KhrSpot(mi.Emitter):
        def __init__(self, properties: Any) -> None:
            mi.Emitter.__init__(self, properties)
            self.origin, self.axis = properties["origin"], mi.Vector3f(properties["axis"])
            self.intensity = mi.Color3f(properties["intensity"])
            self.inner, self.outer = properties["cosines"][0], properties["cosines"][1]
            self.m_flags = int(mi.EmitterFlags.DeltaPosition)

        def sample_direction(self, it: Any, sample: Any, active: Any = True) -> Any:
            ds = mi.DirectionSample3f()
            ds.p, ds.n, ds.uv = mi.Point3f(self.origin), mi.Normal3f(0), mi.Point2f(0)
            ds.pdf, ds.delta, ds.time = mi.Float(1), mi.Bool(True), it.time
            ds.emitter = mi.EmitterPtr(self) if variant == LLVM else self
            ds.d = ds.p - it.p
            ds.dist = dr.norm(ds.d)
            ds.d /= ds.dist
            share = dr.clip((-dr.dot(ds.d, self.axis) - self.outer) / (self.inner - self.outer), 0, 1)
            return ds, dr.select(active, self.intensity * dr.square(share / ds.dist), mi.Color3f(0))

        def pdf_direction(self, it: Any, ds: Any, active: Any = True) -> Any:
            return mi.Float(0)

        def eval(self, si: Any, active: Any = True) -> Any:
            return mi.Color3f(0)

        def bbox(self) -> Any:
            return mi.BoundingBox3f(mi.Point3f(self.origin))

    mi.register_emitter("khr_spot", KhrSpot)
