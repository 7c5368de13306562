# SPDX-License-Identifier: Apache-2.0
"""Every example runs: on less light in this process, and as a program of its own."""

from __future__ import annotations

import os
import runpy
import subprocess
import sys
from pathlib import Path

import deltalux
import pytest

from docs.pages import ROOT

EXAMPLES = sorted((ROOT / "examples").glob("[0-9]*.py"))


def test_there_is_something_to_check() -> None:
    assert len(EXAMPLES) >= 6


every_example = pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)


@pytest.mark.usefixtures("less_light")
@every_example
def test_example_runs_on_less_light(path: Path) -> None:
    runpy.run_path(str(path), run_name="__main__")


@pytest.mark.slow
@every_example
def test_example_runs(path: Path, tmp_path: Path) -> None:
    environment = {**os.environ, "PYTHONPATH": str(Path(deltalux.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, path], cwd=tmp_path, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
