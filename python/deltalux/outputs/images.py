# SPDX-License-Identifier: Apache-2.0
"""Results as pictures: the lit scene, false colours with a legend, differences."""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from deltalux.errors import OptionError
from deltalux.files import written_aside
from deltalux.mesh.display_mesh import DisplayMesh, Poses
from deltalux.mesh.surfaces import CasterType, Surfaces, core_caster
from deltalux.mesh.vertex_light import add_detail
from deltalux.scene import Camera, Scene
from deltalux.units import photopic

from .camera import automatic_camera, scene_camera
from .colour_scale import ColourScale, scale_for, symmetric_scale
from .covered import shown_values
from .drawing import draw_isolines, draw_outlines, label_above, legend
from .tone import KEY, encode_srgb, metered, tone_map
from .view import View

UNSAMPLED = 0.012  # linear grey of a side without samples, whose light is unknown
SURROUNDINGS = 0.03
METERING_SIZE = (96, 60)


@dataclass(frozen=True, eq=False)
class Picture:
    """An image, with the settings that make a second one comparable with it.

    Parameters
    ----------
    pixels : (height, width, 3) uint8, sRGB
    camera : Camera or None
    exposure : float or None, of a lit picture
    scale : ColourScale or None, of a false-colour picture
    """

    pixels: np.ndarray
    camera: Camera | None = None
    exposure: float | None = None
    scale: ColourScale | None = None
    about: dict[str, Any] = field(default_factory=dict)

    def save(self, path: str | os.PathLike[str]) -> None:
        """Write a .png with `about` as the text entry "deltalux"."""
        notes = PngInfo()
        if self.about:
            notes.add_itxt("deltalux", json.dumps(self.about))
        with written_aside(path) as file:
            Image.fromarray(self.pixels).save(file, format="png", pnginfo=notes, optimize=True)


def render(
    scene: Scene,
    display: DisplayMesh,
    irradiance: np.ndarray,
    *,
    poses: Poses | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] = (960, 600),
    exposure: float | None = None,
    stops: float = 0.0,
    false_colour: bool = False,
    scale: ColourScale | None = None,
    isolux: bool = False,
    rays_per_pixel: int = 4,
    threads: int = 0,
    caster: CasterType = core_caster,
    beyond: np.ndarray | None = None,
) -> Picture:
    """Picture of the lit scene, or its photopic irradiance in false colours.

    Each ray interpolates the irradiance of the triangle that it hits; a lit picture shows
    reflectance × irradiance / pi plus emission. A side without samples is dark grey, because its
    light is unknown. Samples covered by other surfaces take their neighbours' values.

    Parameters
    ----------
    scene : Scene
    display : DisplayMesh
    irradiance : (s, 3) linear, one for each sample of `display`
    poses : present poses of movables, see `DisplayMesh.world`
    camera : None = the scene's first camera, else one is chosen automatically
    size : (width, height) in pixels; a legend is added to the width
    exposure : factor on radiance; None = automatic. `Picture.exposure` of one picture makes
        another comparable with it, as do `camera` and `scale`.
    stops : additional exposure in powers of two
    false_colour, scale, isolux : false colours, their scale, and isolines at the scale's ticks
    rays_per_pixel : int
    threads : int, 0 = all
    caster : see `Surfaces`
    beyond : (d, 3) or None, the value of `Session.direct_beyond_samples`

    Raises
    ------
    OptionError
        If `irradiance` does not belong to `display`, or `size` is not positive.
    """
    values = add_detail(_checked_values(display, irradiance).copy(), display, beyond)
    view = _view(scene, display, photopic(values), poses, camera, size, rays_per_pixel, threads, caster)
    values = shown_values(view.surfaces, values)
    if false_colour:
        return _false_colour(view, photopic(values), scale_for, scale, isolux)
    return lit_picture(view, values, exposure, stops)


def lit_picture(view: View, values: np.ndarray, exposure: float | None = None, stops: float = 0.0) -> Picture:
    """The lit scene as `render` draws it, in an existing view.

    Parameters
    ----------
    view : View
    values : (n, 3) irradiance as shown, see `shown_values`, one for each vertex of the view's display
    exposure : factor on radiance; None = automatic
    stops : additional exposure in powers of two
    """
    radiance, light_source = _radiance(view, values)
    if exposure is None:
        exposure = _metered(view, radiance, light_source)
    exposure *= 2.0**stops
    shown = np.where(view.facing[:, None], tone_map(radiance, exposure), _unsampled(view))
    return Picture(encode_srgb(view.pixels(shown)), camera=view.camera, exposure=exposure)


def metered_exposure(
    surfaces: Surfaces, values: np.ndarray, camera: Camera | None = None, key: float = KEY
) -> float:
    """The exposure that a lit picture without textures would choose, to within a few per cent.

    Parameters
    ----------
    surfaces : Surfaces
    values : (n, 3) irradiance as shown, one for each vertex of their display
    camera : None as in `render`
    key : where the typical luminance lands
    """
    camera = _camera(surfaces, photopic(values), camera, METERING_SIZE)
    view = View(surfaces, camera, METERING_SIZE, rays_per_pixel=1)
    return _metered(view, *_radiance(view, values, textured=False), key)


def _metered(view: View, radiance: np.ndarray, light_source: np.ndarray, key: float = KEY) -> float:
    return metered(photopic(radiance[view.facing]), light_source[view.facing], key)


def difference(
    scene: Scene,
    display: DisplayMesh,
    before: np.ndarray,
    after: np.ndarray,
    *,
    poses: Poses | None = None,
    camera: Camera | None = None,
    size: tuple[int, int] = (960, 600),
    scale: ColourScale | None = None,
    rays_per_pixel: int = 4,
    threads: int = 0,
    caster: CasterType = core_caster,
) -> Picture:
    """Photopic irradiance after minus before: orange where brighter, blue where darker.

    The scale is symmetric around zero; the parameters are those of `render`. The scene is drawn at
    `poses`, which should be those after the edit.
    """
    old, new = photopic(_checked_values(display, before)), photopic(_checked_values(display, after))
    view = _view(scene, display, old + new, poses, camera, size, rays_per_pixel, threads, caster)
    change = shown_values(view.surfaces, (new - old)[:, None])[:, 0]
    return _false_colour(view, change, symmetric_scale, scale, isolux=False)


def side_by_side(pictures: Sequence[Picture], labels: Sequence[str]) -> Picture:
    """Pictures of equal height side by side, each with its label above."""
    heights = {len(p.pixels) for p in pictures}
    if len(heights) != 1 or len(pictures) != len(labels):
        raise OptionError(
            f"side_by_side: found {len(pictures)} pictures of heights {sorted(heights)} and "
            f"{len(labels)} labels, expected one height and one label for each picture"
        )
    labelled = [label_above(p.pixels, text) for p, text in zip(pictures, labels, strict=True)]
    gap = np.zeros((len(labelled[0]), 6, 3), dtype=np.uint8)
    strips = [strip for image in labelled for strip in (gap, image)][1:]
    return replace(pictures[0], pixels=np.concatenate(strips, axis=1))


def _checked_values(display: DisplayMesh, irradiance: np.ndarray) -> np.ndarray:
    """Irradiance at the vertices from irradiance (s, 3) of the samples."""
    values, count = np.asarray(irradiance, dtype=np.float64), len(display.sample_vertices)
    if values.shape != (count, 3):
        raise OptionError(
            f"picture: found irradiance of shape {values.shape}, expected "
            f"({count}, 3): one for each sample of the display mesh"
        )
    return display.at_vertices(values)


def _view(
    scene: Scene, display: DisplayMesh, light: np.ndarray, poses: Poses | None, camera: Camera | None,
    size: tuple[int, int], rays_per_pixel: int, threads: int, caster: CasterType,
) -> View:  # fmt: skip
    if min(size) < 1 or rays_per_pixel < 1:
        raise OptionError(
            f"picture: found size {size} and {rays_per_pixel} rays per pixel, expected at least 1"
        )
    surfaces = Surfaces(scene, display, poses, threads, caster)
    return View(surfaces, _camera(surfaces, light, camera, size), size, rays_per_pixel)


def _camera(surfaces: Surfaces, light: np.ndarray, camera: Camera | None, size: tuple[int, int]) -> Camera:
    return camera or scene_camera(surfaces.scene) or automatic_camera(surfaces, light, size[0] / size[1])


def _radiance(view: View, irradiance: np.ndarray, textured: bool = True) -> tuple[np.ndarray, np.ndarray]:
    """Radiance (rays, 3) towards the camera, and whether it comes from a light source."""
    materials = view.surfaces.scene.materials
    reflectance = np.array([m.reflectance for m in materials])
    material = view.surfaces.display.triangle_material[view.triangle]
    reflected = reflectance[material]
    light = view.surfaces.emission(view.triangle, view.facing)
    if textured and view.width is not None:
        colour, glow = view.textures.factors(view.triangle, view.weights, view.width)
        reflected, light = np.minimum(reflected * colour, 1.0), light * glow
    radiance = reflected * np.nan_to_num(view.values(irradiance)) / np.pi
    return (radiance + light) * view.passed[:, None], np.asarray((light > 0).any(axis=1))


def _unsampled(view: View) -> np.ndarray:
    return np.where(view.triangle >= 0, UNSAMPLED, SURROUNDINGS)[:, None]


def _false_colour(
    view: View, values: np.ndarray, choose: Any, scale: ColourScale | None, isolux: bool
) -> Picture:
    seen = view.values(values)
    scale = scale or choose(seen)
    colours = np.where(view.facing[:, None], scale.colours(np.nan_to_num(seen)), _unsampled(view))
    pixels = encode_srgb(view.pixels(colours))
    if scale.diverging:  # most of the picture has one colour; outlines show where a change is
        pixels = draw_outlines(pixels, view.seams())
    if isolux:
        pixels = draw_isolines(pixels, view.pixels(seen)[..., 0], scale.ticks(), view.seams())
    bar = legend(scale, view.surfaces.scene.unit, len(pixels))
    return Picture(np.concatenate([pixels, bar], axis=1), camera=view.camera, scale=scale)
