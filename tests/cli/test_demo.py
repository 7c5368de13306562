# SPDX-License-Identifier: Apache-2.0
"""`deltalux demo`: its files, its promise, and what it says when the promise is broken."""

from __future__ import annotations

from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.cli.commands import demo
from PIL import Image

from .conftest import Cli

FILES = {f"{name}.png" for name in demo.PICTURES} | {"atrium_lit.glb", "report.html"}


class Small(dl.Session):
    """A session of few samples, too."""

    def __init__(self, scene: dl.Scene, **options) -> None:
        super().__init__(scene, dl.Samples.on_vertices(scene, spacing=0.1), gather=16, **options)


@pytest.fixture
def small_atrium(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put the Cornell box in the atrium's place, and its first movable in the trolley's."""
    box = dl.scenes.cornell_box()
    monkeypatch.setattr(dl.scenes, "atrium", lambda: box, raising=False)
    monkeypatch.setattr(demo, "TROLLEY", box.movable[0])
    monkeypatch.setattr(demo, "MOVE", demo.Move(box.movable[0], (0.05, 0, 0.05), 0))
    monkeypatch.setattr(dl, "Session", Small)


def test_writes_pictures_mesh_and_report(cli: Cli, small_atrium: None, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "demo"
    outcome = cli("demo", "-o", folder, "--paths", "20000", "--size", "96x60")
    assert outcome.code == 0
    assert {p.name for p in folder.iterdir()} == FILES
    assert "update and recompute have the same digest: " in outcome.out
    assert "times faster than recomputing" in outcome.out
    before, after = (np.asarray(Image.open(folder / f"{name}.png")) for name in ("before", "after"))
    assert before.shape == after.shape
    assert (before != after).any()
    report = (folder / "report.html").read_text()
    assert report.count("data:image/png;base64,") == 4
    assert 'src="http' not in report
    assert "the same digest" in report


def test_json_has_the_speed_up(cli: Cli, small_atrium: None, tmp_path: Path) -> None:
    data = cli("demo", "-o", tmp_path, "--paths", "20000", "--size", "96x60", "--json").data
    assert data["same_digest"] is True
    assert data["speed_up"] == pytest.approx(data["recompute_milliseconds"] / data["update_milliseconds"])
    assert {Path(p).name for p in data["outputs"]} == FILES


def test_fails_when_update_and_recompute_differ(
    cli: Cli, small_atrium: None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    recompute = dl.Session.recompute

    def wrong(session: dl.Session) -> dl.Frame:
        session.dim(next(iter(session.dim_factors)), 0.5)
        return recompute(session)

    monkeypatch.setattr(dl.Session, "recompute", wrong)
    outcome = cli("demo", "-o", tmp_path, "--paths", "20000", "--size", "96x60")
    assert outcome.code == 1
    assert "update and recompute differ" in outcome.error
