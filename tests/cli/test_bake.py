# SPDX-License-Identifier: Apache-2.0
"""`deltalux bake`: numbers, files, and what the options do."""

from __future__ import annotations

import shlex
from pathlib import Path

import numpy as np
import pytest
from deltalux.outputs import tables
from PIL import Image

from .conftest import CANDELA, HEIGHT, QUICK, Cli


def test_json_has_counts_times_errors_and_digest(cli: Cli, room: Path) -> None:
    data = cli("bake", room, *QUICK, "--json").data
    assert data["paths"] == 20_000
    assert data["samples"] == sum(s["samples"] for s in data["sets"])
    assert data["segments"] >= data["paths"]
    assert data["unit"] == "lux"
    assert data["milliseconds"]
    assert 0 < data["error"]["median"] <= data["error"]["p90"] < 1
    assert len(data["digest"]) == 64
    assert [s["name"] for s in data["sets"]] == ["surfaces", "MOVE_panel"]


def test_summary_tells_what_no_path_reached(cli: Cli, room: Path) -> None:
    few = ("--paths", "20", "--gather", "64", "--spacing", "1", "--radius", "0.01")
    count = cli("bake", room, *few, "--json").data["unreached"]
    assert count > 0
    shown = cli("bake", room, *few)
    assert f"{count} samples: no path reached them" in " ".join(shown.out.split())


def test_summary_shows_minimum_mean_maximum_uniformity(cli: Cli, room: Path) -> None:
    out = cli("bake", room, *QUICK).out
    for word in ("min (lx)", "mean", "max", "uniformity", "surfaces", "MOVE_panel"):
        assert word in out


def test_same_seed_same_bits_for_every_number_of_threads(cli: Cli, room: Path) -> None:
    digests = [
        cli("bake", room, *QUICK, "--json", "--seed", seed, "--threads", threads).data["digest"]
        for seed, threads in (("3", "1"), ("3", "2"), ("4", "1"))
    ]
    assert digests[0] == digests[1]
    assert digests[0] != digests[2]


def test_grid_below_a_lamp_follows_the_inverse_square_law(cli: Cli, room: Path, tmp_path: Path) -> None:
    file = tmp_path / "plane.csv"
    plane = ("--grid", "-1,0.5,-0.5,2,1,0.5")
    data = cli("bake", room, "--paths", "20000", "--gather", "64", *plane, "--json", "-o", file).data
    result = tables.read(file)
    assert len(result.points) == 8
    # A plan is read row by row: +X first, then +Z.
    assert np.allclose(result.points[:2], [[-0.75, 0.5, -0.25], [-0.25, 0.5, -0.25]])
    assert np.allclose(result.points[4], [-0.75, 0.5, 0.25])
    assert np.allclose(result.normals, [0, 1, 0])
    to_lamp = np.array([0, HEIGHT, 0]) - result.points
    distance = np.linalg.norm(to_lamp, axis=1)
    expected = CANDELA * to_lamp[:, 1] / distance**3
    # The floor below sends light up to the panel only, and the panel is far from the plane.
    assert np.allclose(result.irradiance, expected[:, None], rtol=0.02)
    (row,) = data["sets"]
    assert row["minimum"] == pytest.approx(expected.min(), rel=0.02)
    assert row["uniformity"] == pytest.approx(row["minimum"] / row["mean"])


def test_a_session_is_baked_as_it_was_edited(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    """A table of the plane, where the panel stands now: below the lamp, whose light it takes."""
    moved, before, after = tmp_path / "moved.dlx", tmp_path / "before.csv", tmp_path / "after.csv"
    assert cli("update", session_file, "--move", "MOVE_panel=1.45,0,-1.45", "-o", moved).code == 0
    plane = ("--grid", "-0.25,0.2,-0.25,0.5,0.5,0.25", "--paths", "20000", "--gather", "64")
    for source, table in ((session_file, before), (moved, after)):
        assert cli("bake", source, *plane, "-o", table).code == 0
    light = [tables.read(path).irradiance.mean() for path in (before, after)]
    assert light[1] < 0.1 * light[0]


def test_options_of_reading_a_file_are_refused_for_a_session(cli: Cli, session_file: Path) -> None:
    found = cli("bake", session_file, "--unit", "mm")
    assert found.code == 1
    assert "session has been read; leave out --light-units, --unit" in found.error


def test_several_grids_are_summed_up_one_by_one(cli: Cli, room: Path) -> None:
    planes = ("--grid", "-1,0.5,-1,1,1,0.5", "--grid", "0,1,0,1,1,0.25")
    data = cli("bake", room, "--paths", "1000", "--gather", "64", *planes, "--json").data
    assert [(s["name"], s["samples"]) for s in data["sets"]] == [("plane 1", 4), ("plane 2", 16)]


def test_every_output_after_one_option(cli: Cli, room: Path, tmp_path: Path) -> None:
    files = [tmp_path / f"result{suffix}" for suffix in (".glb", ".png", ".csv", ".npz", ".dlx")]
    outcome = cli("bake", room, *QUICK, "-o", *files)
    assert outcome.code == 0
    assert all(file.stat().st_size > 0 for file in files)
    assert outcome.out.count("wrote ") == len(files)
    assert sorted(tmp_path.iterdir()) == sorted(files)  # nothing is left beside them
    csv, npz = tables.read(files[2]), tables.read(files[3])
    assert np.allclose(csv.irradiance, npz.irradiance, rtol=1e-6)
    assert (
        npz.about["command"] == f"deltalux bake {room} {shlex.join(QUICK)} -o {shlex.join(map(str, files))}"
    )


def test_false_colour_is_another_picture_with_a_legend(cli: Cli, room: Path, tmp_path: Path) -> None:
    plain, coloured = tmp_path / "plain.png", tmp_path / "coloured.png"
    cli("bake", room, *QUICK, "-o", plain)
    cli("bake", room, *QUICK, "-o", coloured, "--false-colour")
    with Image.open(plain) as a, Image.open(coloured) as b:
        assert b.width > a.width  # the legend
        assert np.ptp(np.asarray(a.convert("RGB")).std(axis=2)) < np.ptp(
            np.asarray(b.convert("RGB")).std(axis=2)
        )


@pytest.mark.parametrize(
    ("option", "text"),
    [
        ("--target-error=1e-200", "target error: found 1e-200, expected one within reach, such as the 0."),
        ("--spacing=1e300", "spacing: found 1e+300, expected a positive number of metres, at most 1e+15"),
        ("--spacing=1e30", "spacing: found 1e+30, expected a positive number of metres, at most 1e+15"),
        (
            "--spacing=1e-300",
            "spacing: found 1e-300 m, which needs more than 2000000 samples; a spacing of",
        ),
        ("--grid=0,0,0,1e300,1,1", "grid: found 1e+300 metres, expected at most 1e+15"),
        ("--grid=0,0,0,1,1,1e-300", "grid: found 1e+300 × 1e+300 points, expected at most 50,000,000"),
        ("--radius=1e300", "radius: found 1e+300, expected positive metres up to 1e+15"),
        ("--seed=99999999999999999999", "seed: found 99999999999999999999, expected an integer from 0"),
    ],
)
def test_extreme_numbers_are_refused_in_one_line(cli: Cli, room: Path, option: str, text: str) -> None:
    start = ("bake", room, "--paths", "2000", "-q", *(() if "spacing" in option else ("--spacing", "1")))
    outcome = cli(*start, option)
    assert outcome.code == 1
    assert text in outcome.error


def test_target_error_is_reached_and_equals_a_plain_bake(cli: Cli, room: Path) -> None:
    start = ("bake", room, "--spacing", "0.5", "--json")
    first = cli(*start, "--paths", "2000").data
    target = first["error"]["p90"] / 3
    data = cli(*start, "--paths", "2000", "--target-error", str(target)).data
    assert data["error"]["p90"] <= target
    assert data["paths"] > first["paths"]
    assert data["gather"] > first["gather"] == 1536
    again = cli(*start, "--paths", str(data["paths"]), "--gather", str(data["gather"])).data
    assert again["digest"] == data["digest"]


def test_gather_off_takes_discs_and_a_million_paths(cli: Cli, room: Path) -> None:
    data = cli("bake", room, "--spacing", "1", "--gather", "off", "--json").data
    assert (data["gather"], data["paths"]) == ("off", 1_000_000)
    assert "expected a whole number" in cli("bake", room, "--gather", "many").err


def test_radius_is_heard(cli: Cli, room: Path, tmp_path: Path) -> None:
    file = tmp_path / "result.npz"
    cli("bake", room, *QUICK, "--radius", "0.123", "-o", file, "-q")
    assert np.allclose(tables.read(file).radius, 0.123)


def test_quiet_writes_files_and_says_nothing(cli: Cli, room: Path, tmp_path: Path) -> None:
    file = tmp_path / "result.npz"
    outcome = cli("bake", room, *QUICK, "-q", "-o", file)
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")
    assert file.exists()
