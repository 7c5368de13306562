# SPDX-License-Identifier: Apache-2.0
"""Radii of samples that no session could use are refused when the samples are made."""

import re
import warnings

import deltalux as dl
import numpy as np
import pytest
from deltalux.scene import make_movable
from rooms import box, room


@pytest.mark.parametrize("radius", [0.0, -1.0, 1e16, 1e300, np.inf, np.nan, [0.1, 1e300], [np.nan, -1.0]])
def test_radii_beyond_the_engine_s_are_refused(radius):
    wrong = radius if np.ndim(radius) == 0 else radius[1]
    text = f"samples: radius: found {wrong:g}, expected positive metres up to 1e+15"
    with pytest.raises(dl.OptionError, match=re.escape(text)):
        dl.Samples(np.zeros((2, 3)), (0, 1, 0), radius)


def test_the_largest_radius_and_automatic_ones_are_taken():
    samples = dl.Samples(np.zeros((2, 3)), (0, 1, 0), [1e15, np.nan])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        dl.Session(dl.scenes.cornell_box(), samples, paths=10)


def test_a_scene_in_which_everything_moves_has_samples_and_light():
    """Without static meshes no light lands: what moves is judged by what reaches it from outside."""
    still = dl.scenes.cornell_box()
    scene = make_movable(still, [mesh.name for mesh in still.meshes if not mesh.movable])
    assert set(scene.movable) == {mesh.name for mesh in scene.meshes}
    samples = dl.Samples.on_vertices(scene, spacing=0.5, radius=0.2)
    with dl.Session(scene, samples, paths=2000, gather=16, threads=1) as session:
        session.bake()
        assert np.isfinite(session.irradiance).all()
        assert session.irradiance.any()


def test_a_scene_without_triangles_is_refused_whatever_the_samples():
    empty = dl.Mesh("a", np.zeros((0, 3)), np.zeros((0, 3), int), "w")
    scene = dl.Scene([empty], [dl.Material("w")], [dl.PointLight("lamp", (0, 1, 0), (1, 1, 1))])
    with pytest.raises(dl.SceneError, match="found no triangles, expected at least one mesh"):
        dl.Session(scene, dl.Samples([(0, 0, 0)], [(0, 1, 0)])).bake()


def test_samples_of_the_vertices_of_another_scene_are_refused():
    """A session of them could be saved, but not opened again."""
    scene = room()
    static = [mesh for mesh in scene.meshes if not mesh.movable]
    extra = dl.Mesh("first", *box((0.1, 0.1, 0.1), (0, 0.5, 0)), "wall")
    other = dl.Scene([extra, *scene.meshes], scene.materials, scene.lights)
    for made_for, used_in in ((scene, other), (scene, dl.Scene(static, scene.materials))):
        samples = dl.Samples.on_vertices(made_for, spacing=1.0)
        with pytest.raises(dl.OptionError, match=r"another scene.*on_vertices"):
            dl.Session(used_in, samples)
    alone = dl.Samples(samples.points, samples.normals, None, samples.attached)
    dl.Session(other, alone, paths=1000).close()
