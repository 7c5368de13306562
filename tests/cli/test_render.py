# SPDX-License-Identifier: Apache-2.0
"""`deltalux render`: pictures of scenes and sessions, and options that it refuses."""

from __future__ import annotations

import json
from pathlib import Path

import deltalux as dl
import numpy as np
import OpenEXR
import pytest
from deltalux import outputs
from deltalux.outputs.of_session import baked_of
from PIL import Image

from .conftest import QUICK

SMALL = ("--size", "48x30", "--gather", "16")


def test_a_scene_and_its_session_look_alike(cli, tmp_path: Path):
    session = tmp_path / "box.dlx"
    assert cli("bake", "cornell_box", "-o", session, *QUICK).code == 0
    pictures = [tmp_path / "scene.png", tmp_path / "session.png"]
    first = cli("render", "cornell_box", "-o", pictures[0], "--paths", "20000", "--json", *SMALL)
    second = cli("render", session, "-o", pictures[1], "--json", *SMALL)
    assert (first.code, second.code) == (0, 0)
    assert first.data["outputs"] == [str(pictures[0])]
    for path, data in zip(pictures, (first.data, second.data), strict=True):
        with Image.open(path) as image:
            assert image.size == (48, 30)
            assert data["digest"] in image.text["deltalux"]


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


def test_pictures_of_bake_and_update_are_those_of_render(cli, tmp_path: Path):
    session, moved = tmp_path / "box.dlx", tmp_path / "moved.dlx"
    baked, updated, drawn = (tmp_path / f"{name}.png" for name in ("baked", "updated", "drawn"))
    words, size = ("--paths", "5000", "--gather", "8", "--spacing", "0.5"), ("--size", "96x60")
    assert cli("bake", "cornell_box", "-o", session, baked, *words, *size).code == 0
    assert cli("render", session, "-o", drawn, *size).code == 0
    assert (pixels(baked) == pixels(drawn)).all()
    words = ("--move", "short_block=0.02,0,0,20", "--false-colour", *size)
    assert cli("update", session, "-o", moved, updated, *words).code == 0
    assert cli("render", moved, "-o", drawn, "--false-colour", *size).code == 0
    assert (pixels(updated) == pixels(drawn)).all()


@pytest.mark.slow
def test_a_picture_is_drawn_from_samples_where_memory_is_short(cli, tmp_path: Path):
    """What was baked is not lost to a picture that would not fit."""
    session, picture, samples = tmp_path / "box.dlx", tmp_path / "box.png", tmp_path / "samples.png"
    words = ("--paths", "5000", "--gather", "8", "--spacing", "0.5")
    assert cli("bake", "cornell_box", "-o", picture, session, *words, "--memory-limit", "1G").code == 0
    with dl.Session.open(session) as opened:
        outputs.write(samples, baked_of(opened, "deltalux"))
    assert (pixels(picture) == pixels(samples)).all()


def test_options_choose_view_exposure_and_colours(cli, tmp_path: Path):
    path = tmp_path / "lux.png"
    words = ("--paths", "5000", "--json", *SMALL, "--eye", "0.278,0.278,-0.5", "--target", "0.278,0.278,0.5")
    plain = cli("render", "cornell_box", "-o", path, *words).data
    brighter = cli("render", "cornell_box", "-o", path, "--exposure", "1", *words).data
    assert brighter["exposure"] == pytest.approx(2 * plain["exposure"])
    assert cli("render", "cornell_box", "-o", path, "--false-colour", *words).data["exposure"] is None
    with Image.open(path) as image:
        assert image.size[0] > 48  # the legend


def test_layers_beside_a_picture(cli, tmp_path: Path):
    paths = [tmp_path / "box.png", tmp_path / "box.exr"]
    data = cli("render", "cornell_box", "-o", *paths, "--paths", "5000", "--json", *SMALL).data
    assert data["outputs"] == [str(path) for path in paths]
    with OpenEXR.File(str(paths[1]), separate_channels=True) as file:
        assert json.loads(file.header()["comments"])["digest"] == data["digest"]
        channels = {name: channel.pixels for name, channel in file.channels().items()}
    assert channels["R"].shape == (30, 48)
    assert np.allclose(channels["irradiance.G"], channels["direct.G"] + channels["indirect.G"])
    assert {int(k) for k in np.unique(channels["object"])} >= {1, 2}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("-o", "a.tif"), "expected .png (picture), .exr"),
        ((), "no result file"),
        (("-o", "a.exr", "--false-colour"), "without a .png file"),
        (("-o", "a.exr", "--exposure", "1"), "without a .png file"),
        (("-o", "a.png", "--size", "0x4"), "WIDTHxHEIGHT"),
        (("-o", "a.png", "--size", "9"), "WIDTHxHEIGHT"),
        (("-o", "a.png", "--eye", "1,2"), "X,Y,Z"),
        (("-o", "a.png", "--eye", "1,2,3"), "both or none"),
        (("-o", "a.png", "--eye", "1,2,3", "--target", "1,2,3"), "two places"),
        (("-o", "a.png", "--camera", "x", "--eye", "1,2,3", "--target", "0,0,0"), "one of them"),
        (("-o", "a.png", "--camera", "nobody"), "expected a camera of the scene"),
        (("-o", "a.png", "--gather", "off"), "needs rays"),
        (("-o", "a.png", "--exposure", "nan"), "stops up to 32"),
        (("-o", "a.png", "--exposure", "2000"), "stops up to 32"),
    ],
)
def test_options_that_fit_nothing_are_refused(cli, words, told):
    outcome = cli("render", "cornell_box", *words)
    assert outcome.code == 2
    assert told in outcome.error


def test_pictures_beyond_the_memory_are_refused_before_the_bake(cli, tmp_path: Path):
    outcome = cli(
        "render", "cornell_box", "-o", tmp_path / "a.png", "--size", "9999x9999", "--memory-limit", "1M"
    )
    assert outcome.code == 1
    assert "choose fewer pixels" in outcome.error


def test_sessions_bring_their_own_paths(cli, tmp_path: Path):
    session = tmp_path / "box.dlx"
    cli("bake", "cornell_box", "-o", session, "--paths", "2000", "--spacing", "0.5", "--gather", "8")
    outcome = cli("render", session, "-o", tmp_path / "a.png", "--paths", "10")
    assert outcome.code == 2
    assert "leave out --paths, or render the scene" in outcome.error
    assert not (tmp_path / "a.png").exists()
