# SPDX-License-Identifier: Apache-2.0
"""`--grid` and `--margin` of `bake`: planes that stop at walls and furniture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from deltalux.outputs import tables
from PIL import Image

from .conftest import Cli

PLANE = ("--grid", "-2,0.5,-2,4,4,0.5")
QUICK = ("--paths", "5000", "--gather", "64")


@pytest.fixture(scope="module")
def hall(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor of 4 m x 4 m under a lamp, on it a box of 1 m x 1 m x 0.8 m whose middle is at (0.5, -0.5)."""
    lines = [f"v {x} 0 {z}" for x, z in ((-2, -2), (-2, 2), (2, 2), (2, -2))]
    lines += [f"v {x} 3 {z}" for x, z in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
    lines += [f"v {x} {y} {z}" for y in (0, 0.8) for x, z in ((0, -1), (0, 0), (1, 0), (1, -1))]
    lines += ["mtllib hall.mtl", "o floor", "usemtl grey", "f 1 2 3 4", "o lamp", "usemtl glow", "f 5 6 7 8"]
    lines += ["o box", "usemtl grey", "f 9 12 11 10", "f 13 14 15 16"]
    lines += [f"f {9 + i} {9 + (i + 1) % 4} {13 + (i + 1) % 4} {13 + i}" for i in range(4)]
    folder = tmp_path_factory.mktemp("hall")
    (folder / "hall.mtl").write_text(
        "newmtl grey\nKd 0.5 0.5 0.5\nnewmtl glow\nKd 0.5 0.5 0.5\nKe 10 10 10\n"
    )
    (folder / "hall.obj").write_text("\n".join(lines) + "\n")
    return folder / "hall.obj"


def test_points_inside_of_furniture_are_left_out_and_told(cli: Cli, hall: Path, tmp_path: Path) -> None:
    out = [tmp_path / f"plane{suffix}" for suffix in (".csv", ".png", ".dlx")]
    outcome = cli("bake", hall, *PLANE, *QUICK, "--json", "-o", *out)
    told = "plane: of 64 points are left out: 4 inside of or behind walls and furniture"
    assert told in outcome.err
    assert told in outcome.data["warnings"]
    assert outcome.data["samples"] == 60
    assert outcome.data["sets"][0]["minimum"] > 0
    points = tables.read(out[0]).points
    assert not ((points[:, 0] > 0) & (points[:, 0] < 1) & (points[:, 2] > -1) & (points[:, 2] < 0)).any()
    with Image.open(out[1]) as image:
        assert image.width > 800
    again = tmp_path / "again.png"
    assert cli("update", out[2], "-q", "-o", again).code == 0  # the session has the holes, too
    with Image.open(out[1]) as one, Image.open(again) as two:
        assert np.array_equal(np.asarray(one), np.asarray(two))
    assert cli("compare", out[2], out[2], "-q", "-o", tmp_path / "same.png").code == 0


def test_a_margin_is_kept_from_furniture(cli: Cli, hall: Path) -> None:
    outcome = cli("bake", hall, *PLANE, *QUICK, "--margin", "0.3", "--json")
    assert "4 inside of or behind walls and furniture, 8 nearer than 0.3 m to some" in outcome.err
    assert outcome.data["samples"] == 52


def test_a_plane_that_is_nowhere_free_is_refused(cli: Cli, hall: Path) -> None:
    outcome = cli("bake", hall, "--grid", "0.2,0.5,-0.8,0.6,0.6,0.2", *QUICK)
    assert outcome.code == 1
    assert "of 9 points are left out: 9 inside" in outcome.error
    assert "expected some in free air: check the plane's corner" in outcome.error
