# SPDX-License-Identifier: Apache-2.0
"""Exit codes and error lines; wrong usage is found before any work."""

from __future__ import annotations

from pathlib import Path

import pytest
from deltalux.version import __version__

from .conftest import QUICK, Cli

VERBS = ("demo", "info", "plan", "bake", "update", "compare", "compare-methods", "serve")


def test_version(cli: Cli) -> None:
    assert cli("--version").out == f"deltalux {__version__}\n"


@pytest.mark.parametrize("verb", VERBS)
def test_help_teaches_with_an_example(cli: Cli, verb: str) -> None:
    outcome = cli(verb, "--help")
    assert outcome.code == 0
    assert "Example" in outcome.out
    assert f"deltalux {verb}" in outcome.out


def test_without_a_verb_shows_the_verbs(cli: Cli) -> None:
    outcome = cli()
    assert outcome.code == 2
    assert all(verb in outcome.out + outcome.err for verb in VERBS)


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("bark",), "No such command 'bark'"),
        (("info",), "Missing argument 'SCENE|SESSION.dlx'"),
        (("info", "office", "--foo"), "No such option: --foo"),
        (("info", "office", "--light-units", "lux"), "--light-units"),
        (("bake", "nowhere.glb", "-o", "a.foo"), "found suffix '.foo', expected .glb"),
        (("bake", "nowhere.glb", "-o", "a"), "found suffix ''"),
        (("bake", "nowhere.glb", "a.png"), "result files follow -o"),
        (("bake", "nowhere.glb", "-o", "a.png", "-o", "a.png"), "named twice"),
        (("bake", "nowhere.glb", "--grid", "0,0,0,1,1,1", "-o", "a.glb"), "leave out --grid"),
        (("bake", "nowhere.glb", "--grid", "1,2,3"), "X,Y,Z,WIDTH,DEPTH,SPACING"),
        (("bake", "nowhere.glb", "--paths", "0"), "--paths"),
        (("bake", "nowhere.glb", "--threads", "0"), "--threads"),
        (("bake", "nowhere.glb", "--target-error", "-1"), "--target-error"),
        (("plan", "nowhere.glb", "--policy", "luck"), "--policy"),
        (("plan", "nowhere.glb", "--frames", "-1"), "--frames"),
        (("update", "nowhere.dlx", "--move", "chair=1,0"), "NAME=dx,dy,dz"),
        (("compare", "a.txt", "b.npz"), "found suffix '.txt', expected .dlx, .npz or .csv"),
        (("compare", "a.npz", "b.npz", "-o", "c.png"), "a picture needs sessions"),
    ],
)
def test_wrong_usage_is_found_before_any_work(cli: Cli, words: tuple[str, ...], text: str) -> None:
    outcome = cli(*words)
    assert outcome.code == 2
    assert text in outcome.error
    assert outcome.error.endswith("--help)")


def test_missing_scene_names_what_would_do(cli: Cli) -> None:
    outcome = cli("info", "nowhere.glb")
    assert outcome.code == 1
    assert "scene 'nowhere.glb': found no such file, expected a .glb, .gltf or .obj file" in outcome.error
    assert "cornell_box" in outcome.error


def test_misspelt_bundled_scene_is_recognised(cli: Cli) -> None:
    assert "did you mean office?" in cli("info", "offize").error


def test_missing_folder_is_found_before_the_bake(cli: Cli, tmp_path: Path) -> None:
    outcome = cli("bake", "nowhere.glb", "-o", tmp_path / "absent" / "a.png")
    assert outcome.code == 1
    assert "absent: found no such folder" in outcome.error


def test_folder_as_a_file_is_found_before_the_bake(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "a.png").mkdir()
    assert (
        "found a folder, expected the name of a file"
        in cli("bake", "nowhere.glb", "-o", tmp_path / "a.png").error
    )


def test_unknown_movable_is_one_line(cli: Cli, room: Path) -> None:
    outcome = cli("bake", room, "--movable", "sofa", *QUICK)
    assert outcome.code == 1
    assert "sofa" in outcome.error


def test_malformed_file_is_one_line(cli: Cli, room: Path, tmp_path: Path) -> None:
    half = tmp_path / "half.glb"
    half.write_bytes(room.read_bytes()[:400])
    outcome = cli("info", half)
    assert outcome.code == 1
    assert "half.glb" in outcome.error


def test_memory_limit_refuses_with_what_would_fit(cli: Cli, room: Path) -> None:
    outcome = cli("bake", room, "--paths", "5e7", "--spacing", "0.5", "--memory-limit", "100M")
    assert outcome.code == 1
    assert "100 MiB" in outcome.error
    assert "would fit" in outcome.error
