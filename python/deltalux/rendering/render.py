# SPDX-License-Identifier: Apache-2.0
"""Pictures of a session's present light, computed anew at each pixel's surface point."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from deltalux.errors import OptionError
from deltalux.memory import available_memory
from deltalux.mesh.display_mesh import refine
from deltalux.mesh.surfaces import Surfaces
from deltalux.outputs.camera import automatic_camera, scene_camera
from deltalux.outputs.of_session import present_display, present_scene
from deltalux.outputs.textures import ShownTextures
from deltalux.scene import Camera, Scene
from deltalux.session import Session

from .light import LightAtPoints
from .seen import Seen, alike, look, neighbours
from .spread import Fineness, padded, spread

SIZE = (960, 600)  # pixels, width and height
LARGEST = 2**15  # pixels, largest width or height
COARSE = 1e9  # metres; so coarse a spacing leaves the scene's own triangles
BYTES_PER_PIXEL = 2500  # at most, if every pixel is at an edge
STRAIGHT = Fineness(coarsest=2, change=0.03, bend=0.02)  # for direct light: shadows of thin objects are thin
# for indirect light
AROUND = Fineness(coarsest=16, change=0.12, bend=0.04)
# for a scene that is baked for a picture: paths are cheap compared with the picture, and neighbouring pixels
# share their noise
PATHS = 1_200_000
MOST_RAYS = 192  # most gather rays by default: interpolation between pixels averages noise out
EDGE_RAYS = 4  # places in a pixel at an edge, besides its centre
CONTRAST = 0.1  # relative difference of direct light between neighbours that makes an edge
# if direct light around a place in an edge pixel varies by less than this share, it is interpolated
EVEN = 0.05
NEAREST = 1e-30  # metres; the camera itself may lie on a surface
NEIGHBOURHOOD = [(down, right) for down in (-1, 0, 1) for right in (-1, 0, 1)]


@dataclass(frozen=True, eq=False)
class Rendering:
    """Light at the places of a picture: one place for each pixel, several at edges.

    Parameters
    ----------
    size : (width, height) in pixels
    camera : Camera
    scene : Scene, in its present state
    pixel : (k,) int, pixel of each place; the centres of all pixels come first, row by row
    seen : Seen, the places
    direct, indirect : (k, 3) irradiance in the scene's unit
    gathered : number of places whose indirect light was gathered; it was interpolated at the others
    """

    size: tuple[int, int]
    camera: Camera
    scene: Scene
    pixel: np.ndarray
    seen: Seen
    direct: np.ndarray
    indirect: np.ndarray
    gathered: int

    @property
    def irradiance(self) -> np.ndarray:
        """(k, 3) direct plus indirect irradiance."""
        return self.direct + self.indirect

    @property
    def albedo(self) -> np.ndarray:
        """(k, 3) reflectance, with textures; at most 1."""
        reflectance = np.array([m.reflectance for m in self.scene.materials])[self.seen.material]
        return np.minimum(reflectance * self.seen.colour, 1.0) * self.seen.hit[:, None]

    @property
    def radiance(self) -> np.ndarray:
        """(k, 3) radiance towards the camera, including emission."""
        own = self.albedo * self.irradiance / np.pi + self.seen.emission * self.seen.hit[:, None]
        return own * self.seen.passed[:, None]

    def pixels(self, values: np.ndarray) -> np.ndarray:
        """Mean over each pixel's places of values (k, c): (height, width, c)."""
        width, height = self.size
        count = np.bincount(self.pixel, minlength=width * height)
        columns = [np.bincount(self.pixel, column, width * height) / count for column in values.T]
        return np.stack(columns, axis=1).reshape(height, width, -1)

    def middles(self, values: np.ndarray) -> np.ndarray:
        """Values (k, …) at the centres of pixels: (height, width, …)."""
        width, height = self.size
        return values[: width * height].reshape(height, width, *values.shape[1:])


def render_session(
    session: Session,
    *,
    camera: Camera | None = None,
    size: tuple[int, int] = SIZE,
    rays: int | None = None,
    edge_rays: int = EDGE_RAYS,
    keep: bool = True,
    edges_known: Callable[[float], object] | None = None,
) -> Rendering:
    """Compute the light at each pixel's surface point: direct by shadow rays, indirect by final gather.

    Indirect light is gathered where it changes and beside edges and contacts, and interpolated between
    such places. A pixel at the edge of a surface or a shadow has several places. A picture depends on the
    session's state alone: an updated session gives the same picture as a recomputed one.

    Parameters
    ----------
    session : baked, with a final gather; queued edits are applied first
    camera : None = the scene's first camera, else one is chosen automatically
    size : (width, height) in pixels
    rays : gather rays per place, see `Session.at`; None = as the session uses, at most 192
    edge_rays : places in a pixel at an edge, besides its centre
    keep : keep the places' rays and hits in memory, so that the next picture casts again only those that an
        edit changed: up to a gibibyte, a quarter of the free memory at most, nothing under a `memory_limit`
    edges_known : called before any light is computed, with the share of pixels at edges of surfaces; the time
        depends on it most of all

    Raises
    ------
    OptionError
        If the session does not gather, `size` is not positive, or memory does not suffice.
    """
    check_size(size, session.options["memory_limit"])
    if session.options["gather"] == "off":
        raise OptionError('render: found a session of gather="off", expected one that gathers')
    light = LightAtPoints(session, rays or min(int(session.options["gather"]), MOST_RAYS), keep)
    scene = present_scene(session)
    own = session.samples.display
    display = refine(scene, COARSE) if own is None else present_display(own, session.scene, scene)
    # pixels get their own direct light, so pictures do not depend on this refinement
    display = display.without_detail()
    surfaces = Surfaces(scene, display, session.poses, session.options["threads"] or 0)
    # light that the automatic camera weights places by; unknown here
    everywhere = np.ones(len(display.points))
    camera = camera or scene_camera(scene) or automatic_camera(surfaces, everywhere, size[0] / size[1])
    return _Work(surfaces, light, camera, size).rendering(edge_rays, edges_known)


def check_size(size: tuple[int, int], memory_limit: int | None = None) -> None:
    """Refuse sizes without pixels, and those that need more memory than the limit, or than is free.

    Raises
    ------
    OptionError
    """
    width, height = size
    if min(size) < 1 or max(size) > LARGEST:
        raise OptionError(f"size: found {width}x{height} pixels, expected 1 to {LARGEST} along each side")
    if not fits(size, memory_limit):
        raise OptionError(
            f"size: found {width}x{height} pixels, which may need {_bytes(size) >> 20} MiB; the limit is "
            f"{_room(memory_limit) >> 20} MiB: choose fewer pixels, or raise memory_limit"
        )


def fits(size: tuple[int, int], memory_limit: int | None = None) -> bool:
    """Whether a picture fits into the memory limit, or into free memory if there is no limit."""
    return _room(memory_limit) == 0 or _bytes(size) <= _room(memory_limit)


def _bytes(size: tuple[int, int]) -> int:
    return BYTES_PER_PIXEL * size[0] * size[1]


def _room(memory_limit: int | None) -> int:
    return memory_limit or available_memory()


class _Work:
    def __init__(
        self, surfaces: Surfaces, light: LightAtPoints, camera: Camera, size: tuple[int, int]
    ) -> None:
        self._surfaces, self._light, self._camera, self._size = surfaces, light, camera, size
        self._textures = ShownTextures(surfaces)

    def rendering(self, edge_rays: int, edges_known: Callable[[float], object] | None) -> Rendering:
        width, height = self._size
        wide, high = padded(self._size)
        y, x = np.divmod(np.arange(wide * high), wide)
        grid = self._look(x + 0.5, y + 0.5)
        inside = ((y < height) & (x < width)).nonzero()[0]
        seen = grid.at(inside)
        apart = self._apart(seen)
        if edges_known:
            edges_known(float(self._beside_any(apart).mean()))
        found = []
        for name, light, fineness in (
            ("direct light", self._light.direct, STRAIGHT),
            ("indirect light", self._light.indirect, AROUND),
        ):
            self._light.begin(name, fineness.rounds)
            values, asked = spread(grid, (wide, high), light, fineness)
            found.append(values[inside])
        (direct, indirect), gathered = found, int(asked.sum())
        pixel = np.arange(width * height)
        edges = np.flatnonzero(self._edges(seen, apart, direct))
        if edge_rays and len(edges):
            self._light.begin("edges", 2)
            more, number = self._inside(edges, edge_rays)
            found, alone, uneven = self._beside(more, number, seen, direct, indirect)
            found[1][alone], _ = self._light.indirect(more.at(alone), one_of=2)
            found[0][uneven], _ = self._light.direct(more.at(uneven))
            gathered += int(alone.sum())
            direct, indirect = (np.concatenate(pair) for pair in zip((direct, indirect), found, strict=True))
            pixel = np.concatenate([pixel, number])
            seen = Seen.joined([seen, more])
        scene = self._surfaces.scene
        return Rendering(self._size, self._camera, scene, pixel, seen, direct, indirect, gathered)

    def _look(self, x: np.ndarray, y: np.ndarray) -> Seen:
        return look(self._surfaces, self._textures, self._camera, self._size, x, y)

    def _apart(self, seen: Seen) -> list[np.ndarray]:
        """(pairs,) bool for each pair of `neighbours`: whether the two pixels show different surfaces."""
        found = []
        for pairs in neighbours(self._size):
            a, b = (seen.at(side.ravel()) for side in pairs)
            found.append((a.hit | b.hit) & (~alike(a, b) | (a.material != b.material) | (a.mesh != b.mesh)))
        return found

    def _beside_any(self, apart: list[np.ndarray]) -> np.ndarray:
        """(pixels,) bool: whether a pixel belongs to a pair that `apart` marks."""
        found = np.zeros(self._size[0] * self._size[1], dtype=bool)
        for pairs, own in zip(neighbours(self._size), apart, strict=True):
            for side in pairs:
                found[side.ravel()[own]] = True
        return found

    def _edges(self, seen: Seen, apart: list[np.ndarray], direct: np.ndarray) -> np.ndarray:
        """(pixels,) bool: whether a neighbour shows another surface or different direct light."""
        bright = direct.sum(axis=1)
        floor = 0.02 * bright[seen.hit].mean() if seen.hit.any() else 0.0
        either = []
        for pairs, own in zip(neighbours(self._size), apart, strict=True):
            e, f = (bright[side.ravel()] for side in pairs)
            either.append(own | (np.abs(e - f) > CONTRAST * np.maximum(0.5 * (e + f), floor)))
        return self._beside_any(either)

    def _inside(self, pixels: np.ndarray, count: int) -> tuple[Seen, np.ndarray]:
        """Further places in each of `pixels`, and the pixel number of each place."""
        number = np.repeat(pixels, count)
        k = np.tile(np.arange(count), len(pixels))
        across, down = _within(count)
        y, x = np.divmod(number, self._size[0])
        return self._look(x + across[k], y + down[k]), number

    def _beside(
        self, more: Seen, number: np.ndarray, seen: Seen, direct: np.ndarray, indirect: np.ndarray
    ) -> tuple[list[np.ndarray], np.ndarray, np.ndarray]:
        """Light at places in edge pixels, interpolated from the pixel centres around them.

        Returns
        -------
        direct and indirect light (k, 3); (k,) bool, places without a pixel centre on their surface;
        (k,) bool, those, and places between pixel centres with different direct light
        """
        width, height = self._size
        y, x = np.divmod(number, width)
        both, bright = np.concatenate([direct, indirect], axis=1), direct.sum(axis=1)
        total, weight = np.zeros((len(more), 6)), np.zeros(len(more))
        least, most = np.full(len(more), np.inf), np.zeros(len(more))
        for down, right in NEIGHBOURHOOD:
            i, j = y + down, x + right
            inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
            other = np.where(inside, i * width + j, number)
            middle = seen.at(other)
            use = inside & alike(more, middle)
            apart = np.linalg.norm(more.point - middle.point, axis=1)
            own = use / np.maximum(apart + 0.1 * more.width, NEAREST)
            total += own[:, None] * both[other]
            weight += own
            least = np.where(use, np.minimum(least, bright[other]), least)
            most = np.where(use, np.maximum(most, bright[other]), most)
        found = total / np.where(weight > 0, weight, 1.0)[:, None]
        alone = more.hit & (weight == 0)
        uneven = alone | (more.hit & (most - least > EVEN * most))
        return [found[:, :3], found[:, 3:]], alone, uneven


def _within(count: int) -> tuple[np.ndarray, np.ndarray]:
    """Well distributed places in a pixel, without its centre (R2 sequence of Roberts, 2018)."""
    k = np.arange(1, count + 1)
    return (0.5 + 0.7548776662466927 * k) % 1, (0.5 + 0.5698402909980532 * k) % 1
