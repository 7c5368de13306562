# SPDX-License-Identifier: Apache-2.0
"""What passes panes and what they mirror, against closed forms; and edits among them."""

from __future__ import annotations

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene.surfaces import WINDOW
from rooms import box
from thoroughness import slow

HEIGHT = 2.0  # of the lamp
FACES = [(0, 1, 2), (0, 2, 3)]


def square(name: str, centre: tuple[float, float, float], side: float, material: str, **more) -> dl.Mesh:
    """A horizontal square that faces up."""
    corners = np.array([(-1, 0, 1), (1, 0, 1), (1, 0, -1), (-1, 0, -1)], float) * side / 2
    return dl.Mesh(name, corners + centre, FACES, material, **more)


def below_pane(surface: dl.scene.Surface | None) -> dl.Scene:
    """A black floor below a lamp, with a pane between them unless `surface` is None."""
    meshes = [square("floor", (0, 0, 0), 8, "black")]
    if surface is not None:
        meshes.append(square("pane", (0.3, 1, 0.2), 8, "glass"))
    return dl.Scene(
        meshes,
        [dl.Material("black", (0, 0, 0)), dl.Material("glass", (0, 0, 0), surface=surface or WINDOW)],
        [dl.PointLight("lamp", (0, HEIGHT, 0), (100, 100, 100))],
        unit="lux",
    )


def fresnel(cosine: np.ndarray, index: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Reflectances of both polarisations, and the cosine inside."""
    inside = np.sqrt(1 - (1 - cosine**2) / index**2)
    s = ((cosine - index * inside) / (cosine + index * inside)) ** 2
    p = ((index * cosine - inside) / (index * cosine + inside)) ** 2
    return s, p, inside


def passed(surface: dl.PaneSurface, cosine: np.ndarray) -> np.ndarray:
    """Written down a second time, from CIE 171:2006, 5.10."""
    s, p, inside = fresnel(cosine, surface.index)
    if surface.faces == 1:
        glass = 1 - (s + p) / 2
    else:
        t = surface.inner ** (1 / inside)
        glass = sum((1 - r) ** 2 * t / (1 - r**2 * t**2) for r in (s, p)) / 2
    covered = surface.coverage * surface.transmission * surface.tint * glass
    return 1 - surface.coverage + covered


def direct_on_floor(scene: dl.Scene, x: np.ndarray) -> np.ndarray:
    points = np.stack([x, np.zeros_like(x), 0.4 * x], axis=1)
    with dl.Session(scene, dl.Samples(points, [(0, 1, 0)]), paths=2000, gather=16) as session:
        session.bake()
        return session.irradiance[:, 0].copy()


@pytest.mark.parametrize(
    "surface",
    [
        WINDOW,
        dl.PaneSurface(),
        dl.PaneSurface(index=1.8, faces=2, inner=0.7, tint=0.5),
        dl.PaneSurface(coverage=0.3, transmission=0),
        dl.PaneSurface(coverage=0.6, transmission=0.5, index=1),
        dl.PaneSurface(inner=0),  # of one face, nothing is inside
    ],
    ids=["window", "literal", "dark", "film", "half", "face"],
)
def test_a_pane_over_a_floor_passes_what_the_formula_says_at_every_angle(surface):
    """The first sample lies straight below the lamp, and the pane's diagonal may lie between them."""
    x = np.linspace(0, 3.9, 14)
    bare, dimmed = (direct_on_floor(below_pane(each), x) for each in (None, surface))
    cosine = HEIGHT / np.sqrt(HEIGHT**2 + (1 + 0.4**2) * x**2)
    np.testing.assert_allclose(dimmed / bare, passed(surface, cosine), rtol=1e-5)
    assert surface.passes == pytest.approx(float(passed(surface, np.ones(1))[0]))


def test_the_common_edge_of_two_triangles_counts_once():
    """A lamp, a pane's diagonal and samples in one vertical plane; a doubled pane counts once, too."""
    scene = below_pane(WINDOW)
    centred = square("pane", (0, 1, 0), 8, "glass")
    again = square("again", (0, 1, 0), 8, "glass")
    x = np.linspace(0, 2, 9)
    points = np.stack([x, np.zeros_like(x), -x], axis=1)
    found = []
    for meshes in ([centred], [centred, again]):
        own = dl.scene.replace_scene(scene, meshes=[scene.meshes[0], *meshes])
        with dl.Session(own, dl.Samples(points, [(0, 1, 0)]), paths=2000, gather=16) as session:
            session.bake()
            found.append(session.irradiance[:, 0] * (HEIGHT**2 + 2 * x**2) ** 1.5 / (100 * HEIGHT))
    expected = passed(WINDOW, HEIGHT / np.sqrt(HEIGHT**2 + 2 * x**2))
    np.testing.assert_allclose(found, [expected, expected], rtol=1e-5)


@pytest.mark.parametrize(
    ("values", "told"),
    [
        ({"coverage": 1.2}, "coverage: found 1.2, expected 0 to 1"),
        ({"tint": float("nan")}, "tint: found nan, expected 0 to 1"),
        ({"index": 0.9}, "index: found 0.9, expected 1 to 10"),
        ({"faces": 3}, "faces: found 3, expected 1 or 2"),
        ({"coverage": None}, "coverage: found None, expected a number"),
    ],
)
def test_impossible_panes_are_refused(values, told):
    with pytest.raises(dl.SceneError, match=told):
        dl.PaneSurface(**values)


def furnace(surfaces: dict[str, dl.scene.Surface]) -> dl.Scene:
    """A room whose walls all glow and reflect alike, and in it panes that absorb nothing."""
    walls = dl.Mesh("walls", *box((4, 3, 3), (0, 1.5, 0), inward=True), "wall")
    panes = [square(name, (-1.4 + 0.9 * k, 0.8 + 0.3 * k, 0.2), 0.8, name) for k, name in enumerate(surfaces)]
    for x in (-0.1, 0.1):  # light goes to and fro between them
        upright = [(x, 0.01, -1.4), (x, 0.01, -0.4), (x, 1.2, -0.4), (x, 1.2, -1.4)]
        panes.append(dl.Mesh(f"upright {x}", upright, FACES, "glass"))
    materials = [dl.Material("wall", (REFLECTED,) * 3, (10, 10, 10))]
    materials += [dl.Material(name, (1, 1, 1), surface=each) for name, each in surfaces.items()]
    return dl.Scene([walls, *panes], materials, unit="lux")


REFLECTED = 0.8  # by the walls: light goes on for long
# Mirrors, passes and scatters: each is a third way for light.
WHITE = {
    "glass": dl.PaneSurface(index=10),
    "plate": dl.PaneSurface(index=1.7, faces=2),
    "film": dl.PaneSurface(coverage=0.6, transmission=0),
    "half": dl.PaneSurface(coverage=0.8, transmission=0.5, index=8),
}


@pytest.mark.parametrize("gather", [256, slow("off")])
def test_a_white_furnace_stays_uniform(gather):
    """Null hypothesis: the irradiance is that without panes, pi L / (1 - reflectance), at each sample.

    Below the claimed errors by quantiles; 0.5 % of bias is more than five standard errors of the mean.
    """
    scene = furnace(WHITE)
    points, normals = [], []
    for x in np.linspace(-1.6, 1.6, 9):
        for z in (-1.0, 0.2, 1.0):
            points += [(x, 0, z), (x, 3, z)]
            normals += [(0, 1, 0), (0, -1, 0)]
    for k in range(len(WHITE)):
        points += [(-1.4 + 0.9 * k, 0.8 + 0.3 * k, 0.25)] * 2
        normals += [(0, 1, 0), (0, -1, 0)]
    between = [(0, 0, z) for z in np.linspace(-1.2, -0.6, 12)]
    points, normals = points + between, normals + [(0, 1, 0)] * len(between)
    radius = np.repeat([0.15, 0.08], [len(points) - len(between), len(between)])
    samples = dl.Samples(points, normals, radius)
    with dl.Session(scene, samples, paths=1_000_000, gather=gather, seed=5) as session:
        session.bake()
        found, claimed = session.irradiance[:, 0], session.standard_error[:, 0]
    error = found / (10 * np.pi / (1 - REFLECTED)) - 1
    assert abs(error.mean()) < 0.005
    assert abs(error[-len(between) :].mean()) < (0.01 if gather == 256 else 0.03)
    assert np.quantile(np.abs(error) * found / claimed, 0.9) < 2.5
