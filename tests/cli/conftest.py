# SPDX-License-Identifier: Apache-2.0
"""Runs of the command line inside this process, on a room small enough for many of them."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest
from builders.gltf import GltfBuilder
from deltalux.cli import run

HALF_TURN_UP = [-(0.5**0.5), 0, 0, 0.5**0.5]  # turns +Z, where builder quads look, to +Y
CANDELA = 400.0
HEIGHT = 2.0
QUICK = ("--paths", "20000", "--spacing", "0.5", "--gather", "64")


@dataclass(frozen=True)
class Outcome:
    """What one command line did."""

    code: int
    out: str
    err: str

    @property
    def data(self) -> dict[str, Any]:
        """Standard output as JSON."""
        return json.loads(self.out)

    @property
    def error(self) -> str:
        """The one line of standard error, which must be an error."""
        lines = self.err.splitlines()
        assert len(lines) == 1, self.err
        assert lines[0].startswith("error: ")
        return lines[0]


Cli = Callable[..., Outcome]


@pytest.fixture
def cli(capsys: pytest.CaptureFixture[str]) -> Cli:
    """Run `deltalux` with these words."""

    def call(*words: str | Path) -> Outcome:
        capsys.readouterr()
        code = run([str(word) for word in words])
        captured = capsys.readouterr()
        return Outcome(code, captured.out, captured.err)

    return call


@pytest.fixture(scope="session")
def room(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A floor of 4 m x 4 m, a lamp of 400 cd in the middle 2 m above it, a panel to move."""
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    oak = builder.material(name="oak", colour=(0.4, 0.3, 0.2))
    floor = {"rotation": HALF_TURN_UP, "translation": [-2, 0, 2], "scale": [4, 4, 4]}
    builder.node(name="floor", mesh=builder.quad(grey), **floor)
    panel = {"rotation": HALF_TURN_UP, "translation": [-1.7, 0.7, 1.7], "scale": [0.5, 0.5, 0.5]}
    builder.node(name="MOVE_panel", mesh=builder.quad(oak), **panel)
    lamp = builder.light(name="lamp", type="point", intensity=CANDELA, color=[1, 1, 1])
    builder.node(name="lamp", translation=[0, HEIGHT, 0], extensions=lamp)
    return builder.write(tmp_path_factory.mktemp("room"), "room.glb")


@pytest.fixture(scope="session")
def session_file(room: Path) -> Path:
    """A saved session of the room."""
    path = room.with_suffix(".dlx")
    assert run(["bake", str(room), *QUICK, "-q", "-o", str(path)]) == 0
    return path
