# SPDX-License-Identifier: Apache-2.0
"""`deltalux compare`: differences as numbers and as a picture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from deltalux.report import compare
from PIL import Image

from .conftest import QUICK, Cli


def test_numbers_of_a_known_difference() -> None:
    a = np.array([[10.0, 10.0, 10.0], [0.0, 0.0, 0.0]])
    b = np.array([[11.0, 11.0, 11.0], [0.0, 0.0, 0.0]])
    data = compare(a, b)
    assert data["changed"] == 1
    assert data["mean_difference"] == pytest.approx(0.5)
    assert data["rms_difference"] == pytest.approx(0.5**0.5)
    assert data["largest_difference"] == pytest.approx(1.0)
    assert data["largest_index"] == 0
    # The dark sample counts as 10 % of the channel's mean, and does not differ.
    assert data["rms_relative_difference"] == pytest.approx((0.1**2 / 2) ** 0.5)


def test_dark_samples_do_not_blow_up_the_relative_difference() -> None:
    a, b = np.array([[20.0] * 3, [0.0] * 3]), np.array([[20.0] * 3, [1.0] * 3])
    assert compare(a, b)["rms_relative_difference"] == pytest.approx(0.5**0.5)  # 1 over 10 % of 10


@pytest.fixture(scope="module")
def moved_file(session_file: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    from deltalux.cli import run

    path = tmp_path_factory.mktemp("moved") / "moved.dlx"
    assert run(["update", str(session_file), "--move", "MOVE_panel=1,0,-1", "-q", "-o", str(path)]) == 0
    return path


def test_session_with_itself(cli: Cli, session_file: Path) -> None:
    data = cli("compare", session_file, session_file, "--json").data
    assert data["changed"] == 0
    assert data["rms_difference"] == 0
    assert data["same_digest"] is True


def test_sessions_before_and_after_a_move(
    cli: Cli, session_file: Path, moved_file: Path, tmp_path: Path
) -> None:
    picture = tmp_path / "difference.png"
    data = cli("compare", session_file, moved_file, "--json", "-o", picture).data
    assert data["same_digest"] is False
    assert data["changed"] > 0
    assert data["moved_samples"] > 0
    with Image.open(picture) as image:
        assert np.asarray(image.convert("RGB")).std() > 1


def test_tables_of_two_seeds_differ_by_noise(cli: Cli, room: Path, tmp_path: Path) -> None:
    files = [tmp_path / "one.npz", tmp_path / "two.csv"]
    for seed, file in enumerate(files, 1):
        cli("bake", room, *QUICK, "--seed", str(seed), "-o", file, "-q")
    outcome = cli("compare", *files)
    assert outcome.code == 0
    assert "RMS relative difference" in outcome.out


def test_results_of_other_samples_are_refused(cli: Cli, room: Path, tmp_path: Path) -> None:
    files = [tmp_path / "one.npz", tmp_path / "two.npz"]
    for spacing, file in zip(("0.5", "0.3"), files, strict=True):
        cli("bake", room, "--paths", "1000", "--gather", "64", "--spacing", spacing, "-o", file, "-q")
    outcome = cli("compare", *files)
    assert outcome.code == 1
    assert "samples, expected" in outcome.error


def test_foreign_table_is_one_line(cli: Cli, tmp_path: Path) -> None:
    file = tmp_path / "foreign.csv"
    file.write_text("a,b\n1,2\n")
    outcome = cli("compare", file, file)
    assert outcome.code == 1
    assert "foreign.csv" in outcome.error
