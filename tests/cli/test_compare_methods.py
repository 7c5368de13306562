# SPDX-License-Identifier: Apache-2.0
"""`deltalux compare-methods`: a complete page and tables, equal sums, and errors before the work."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from deltalux.cli import run
from deltalux.cli.commands.compare_methods import PAGE, PICTURES, TABLES
from deltalux.studies.method_errors import Reference
from deltalux.studies.method_list import METHODS
from deltalux.studies.report.method_findings import findings
from PIL import Image

from .conftest import Cli

QUICK = ("--quick", "--spacing", "0.25", "--samples", "400", "--paths", "20000", "--reference", "4")


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Folder and --json of one quick comparison in the Cornell box."""
    folder = tmp_path_factory.mktemp("methods") / "new" / "folder"
    printed = folder.parent.parent / "printed.json"
    with pytest.MonkeyPatch.context() as patch, printed.open("w") as stream:
        patch.setattr("sys.stdout", stream)
        assert run(["compare-methods", "cornell_box", *QUICK, "--json", "-o", str(folder)]) == 0
    return folder, json.loads(printed.read_text())


def test_page_is_complete_and_self_contained(compared: tuple[Path, dict[str, Any]]) -> None:
    folder, data = compared
    assert {p.name for p in folder.iterdir()} == {PAGE, *TABLES, *PICTURES}
    page = (folder / PAGE).read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == len(PICTURES)
    assert 'src="http' not in page
    assert ">nan<" not in page
    assert all(f"<td>{method.label}</td>" in page for method in METHODS)
    assert len(data["findings"]) >= 5


def test_tables_parse_and_hold_every_method(compared: tuple[Path, dict[str, Any]]) -> None:
    folder, data = compared
    with (folder / "methods.csv").open(newline="") as file:
        rows = {row["name"]: row for row in csv.DictReader(file)}
    assert list(rows) == [*(method.name for method in METHODS), "session"]
    for row in data["methods"]:
        assert float(rows[row["name"]]["rms_error"]) == pytest.approx(row["rms_error"])
    with (folder / "equal_count.csv").open(newline="") as file:
        names = [row["name"] for row in csv.DictReader(file)]
    assert names[:2] == ["discs_of_k", "clipped_discs_of_k"]
    assert "photon_map" in names


def test_exact_methods_have_equal_sums(compared: tuple[Path, dict[str, Any]]) -> None:
    rows = {row["name"]: row for row in compared[1]["methods"]}
    exact = [row for row in rows.values() if row["kind"] == "disc" and "equal" in row]
    assert len(exact) == 5
    assert all(row["equal"] for row in exact)
    assert not rows["sphere_cache_literal"]["equal"]
    assert 0 < rows["sphere_cache_literal"]["lost"] < 0.5


def test_fixed_area_holds_k_on_average(compared: tuple[Path, dict[str, Any]]) -> None:
    table = compared[1]["equal_count"]
    assert table["mean_count"] == pytest.approx(compared[1]["k"], rel=0.05)


def test_plain_photon_map_overestimates(compared: tuple[Path, dict[str, Any]]) -> None:
    """Both forms use the same hits, whose noise their ratio is nearly free of."""
    k = compared[1]["k"]
    assert compared[1]["plain_over_unbiased"] - 1 == pytest.approx(1 / (k - 1), rel=0.25)


def test_pictures_show_something(compared: tuple[Path, dict[str, Any]]) -> None:
    for name in PICTURES:
        assert np.asarray(Image.open(compared[0] / name)).std() > 10


def test_findings_follow_the_figures(compared: tuple[Path, dict[str, Any]]) -> None:
    data = json.loads(json.dumps(compared[1]))
    assert "equal sums" in findings(data)[0]
    data["methods"][1]["equal"] = False
    assert "brute force differ from the disc index" in findings(data)[0]
    good = {"rms_error": 0.2, "bias": 0.0, "median": 0.0, "too_dark": 0.01, "too_bright": 0.0}
    bad = good | {"too_dark": 0.6, "bias": -0.7}
    for row in data["equal_count"]["rows"]:
        fails = row["name"] == "photon_map"
        row["by_class"] |= {"inside": good, "very small": bad if fails else good}
    data["equal_count"]["count_by_class"]["very small"] = 50.0
    text = " ".join(findings(data))
    assert "fail on very small surfaces (paper 1.2) shows here; discs fail 60.0 times less often" in text
    for row in data["equal_count"]["rows"]:
        row["by_class"]["very small"] = good
    assert "fail on very small surfaces (paper 1.2) does not show in this scene" in " ".join(findings(data))


def test_noise_of_the_reference_is_taken_out() -> None:
    """A perfect estimate against a reference with 10 % noise has nearly no error of its own.

    Errors are relative to the noisy value, of which 0.0006 remains in the mean square, with a standard
    deviation of 0.00006: the bound, 0.035², is ten of these above. With the noise left in it is 0.011.
    """
    truth = np.ones((20_000, 3))
    noisy = truth + 0.1 * np.random.default_rng(1).standard_normal(truth.shape)
    reference = Reference(noisy, np.full(truth.shape, 0.1), np.zeros(len(truth), int))
    errors = reference.figures(truth, np.arange(len(truth)))
    assert errors["rms_error"] < 0.035
    assert errors["by_class"]["edge"] is None


def test_unknown_scene_leaves_no_folder(cli: Cli, tmp_path: Path) -> None:
    outcome = cli("compare-methods", "atriun", "-o", tmp_path / "out")
    assert outcome.code == 1
    assert "did you mean atrium?" in outcome.error
    assert not (tmp_path / "out").exists()


def test_unwritable_folder_is_found_before_the_work(cli: Cli, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    outcome = cli("compare-methods", "cornell_box", "-o", tmp_path / "file" / "out")
    assert outcome.code == 1
    assert "file" in outcome.error


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("cornell_box",), "Missing option '-o'"),
        (("cornell_box", "-o", "x", "--k", "2"), "--k"),
        (("cornell_box", "-o", "x", "--paths", "0"), "--paths"),
        (("cornell_box", "-o", "x", "--reference", "1"), "--reference"),
    ],
)
def test_wrong_usage(cli: Cli, words: tuple[str, ...], text: str) -> None:
    outcome = cli("compare-methods", *words)
    assert outcome.code == 2
    assert text in outcome.error
