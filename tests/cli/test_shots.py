# SPDX-License-Identifier: Apache-2.0
"""Where pictures are taken from, how large and how bright: the same options of every command."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from deltalux.cli.shots import Shot, shot_of
from PIL import Image
from typer import BadParameter

from .conftest import Cli

EYE = ("--eye", "0.5,1.5,3.5", "--target", "0,0.3,0")
SMALL = ("--size", "48x30")
QUICK = ("--paths", "2000", "--spacing", "0.7", "-q")


def pixels(path: Path) -> np.ndarray:
    with Image.open(path) as image:
        return np.asarray(image)


@pytest.fixture(scope="module")
def baked(room: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with a session that gathers, one that does not, and a picture of each."""
    from deltalux.cli import run

    folder = tmp_path_factory.mktemp("shots")
    for name, gather in (("rays", "8"), ("discs", "off")):
        results = [str(folder / f"{name}{suffix}") for suffix in (".dlx", ".png")]
        assert run(["bake", str(room), "-o", *results, *EYE, *SMALL, *QUICK, "--gather", gather]) == 0
    return folder


def test_pictures_of_bake_and_update_through_a_camera_are_those_of_render(
    cli: Cli, baked: Path, tmp_path: Path
) -> None:
    drawn, updated = tmp_path / "drawn.png", tmp_path / "updated.png"
    assert cli("render", baked / "rays.dlx", "-o", drawn, *EYE, *SMALL).code == 0
    assert pixels(drawn).shape == (30, 48, 3)
    assert (pixels(drawn) == pixels(baked / "rays.png")).all()
    brighter = ("--exposure", "1.5")
    assert cli("update", baked / "rays.dlx", "-o", updated, *EYE, *SMALL, *brighter).code == 0
    assert cli("render", baked / "rays.dlx", "-o", drawn, *EYE, *SMALL, *brighter).code == 0
    assert (pixels(updated) == pixels(drawn)).all()
    assert pixels(updated).mean() > pixels(baked / "rays.png").mean() + 10


def test_pictures_of_samples_take_the_same_options(cli: Cli, baked: Path, tmp_path: Path) -> None:
    plain, brighter = baked / "discs.png", tmp_path / "brighter.png"
    assert pixels(plain).shape == (30, 48, 3)
    assert cli("update", baked / "discs.dlx", "-o", brighter, *EYE, *SMALL, "--exposure", "1.5").code == 0
    assert pixels(brighter).mean() > pixels(plain).mean() + 10
    other = tmp_path / "other.png"
    from_below = ("--eye", "0.5,0.5,3.5", "--target", "0,0.3,0")
    assert cli("update", baked / "discs.dlx", "-o", other, *from_below, *SMALL).code == 0
    assert (pixels(other) != pixels(plain)).any()


def test_differences_take_them_but_for_the_exposure(cli: Cli, baked: Path, tmp_path: Path) -> None:
    moved, seen, other = (tmp_path / name for name in ("moved.dlx", "seen.png", "other.png"))
    assert cli("update", baked / "discs.dlx", "--dim", "lamp=0.5", "-o", moved).code == 0
    words = ("compare", baked / "discs.dlx", moved, "-o")
    assert cli(*words, seen, *EYE, *SMALL).code == 0
    assert cli(*words, other, "--eye", "0.5,0.5,3.5", "--target", "0,0.3,0", *SMALL).code == 0
    assert pixels(seen).shape[0] == 30
    assert (pixels(seen) != pixels(other)).any()


@pytest.mark.parametrize("command", ["bake", "update", "compare", "render", "demo"])
def test_every_command_that_makes_pictures_has_them(cli: Cli, command: str) -> None:
    said = cli(command, "--help").out
    for option in ("--camera", "--eye", "--target", "--size"):
        assert option in said
    assert ("--exposure" in said) == (command != "compare")


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (
            ("bake", "office", "-o", "a.npz", "--size", "48x30"),
            "found --size without a picture; add -o OUT.png",
        ),
        (("bake", "office", "--exposure", "1"), "found --exposure without a picture"),
        (("bake", "office", "-o", "a.png", "--eye", "1,2,3"), "both or none"),
        (
            ("bake", "office", "-o", "a.png", "--grid", "0,1,0,1,1,1", *SMALL),
            "--size for a working plane",
        ),
        (("bake", "cornell_box", "-o", "a.png", "--camera", "no"), "expected a camera of the scene: 'main'"),
        (("bake", "office", "-o", "a.png", "--exposure", "1", "--false-colour"), "which has a scale"),
        (("update", "a.dlx", "-o", "a.npz", "--camera", "x"), "found --camera without a picture"),
        (("compare", "a.dlx", "b.dlx", *SMALL), "found --size without a picture"),
        (("demo", "--eye", "1,2,3", "--target", "1,2,3"), "two places"),
    ],
)
def test_what_fits_nothing_is_refused_before_any_work(cli: Cli, words: tuple[str, ...], text: str) -> None:
    outcome = cli(*words)
    assert outcome.code == 2
    assert text in outcome.error


def test_a_size_beyond_the_memory_is_refused_where_it_was_asked_for(cli: Cli) -> None:
    outcome = cli("bake", "office", "-o", "a.png", "--size", "9999x9999", "--memory-limit", "1M")
    assert outcome.code == 1
    assert "choose fewer pixels" in outcome.error


def test_a_shot_without_options_is_the_usual_one() -> None:
    shot = shot_of(None, None, None, None, targets=[])
    assert shot == Shot()
    assert (shot.given, shot.pixels) == (None, 960 * 600)
    with pytest.raises(BadParameter, match="up to 32"):
        shot_of(None, None, None, None, float("nan"), targets=[Path("a.png")])


def test_what_a_picture_says_of_itself_names_the_options(baked: Path) -> None:
    with Image.open(baked / "rays.png") as image:
        assert "--eye 0.5,1.5,3.5" in json.loads(image.text["deltalux"])["command"]
