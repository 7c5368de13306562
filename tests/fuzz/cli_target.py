# SPDX-License-Identifier: Apache-2.0
"""Fuzz target: the command line. One line of error, a known exit code, no file harmed, no traceback."""

from __future__ import annotations

import contextlib
import importlib
import io
import json
import os
import shutil
import signal
from pathlib import Path

import numpy as np
from builders.gltf import GltfBuilder
from builders.obj import mtl_text, obj_text
from deltalux.cli import run
from deltalux.errors import Error
from rooms import room

from fuzz.command_lines import command_line
from fuzz.harness import MIB, Limits
from fuzz.mutate_json import Rng

EXIT_CODES = (0, 1, 2, 130)
INTERRUPTED_AFTER = 2.0  # seconds; `view` waits for Ctrl-C, studies and large bundled scenes take minutes
LOADED_LATE = ("matplotlib.backends.backend_agg", "matplotlib.figure", "matplotlib.ticker")
INPUTS = ("room.glb", "room.obj", "room.mtl", "room.dlx", "damaged.glb", "damaged.dlx", "damaged.npz",
          "result.npz", "result.csv", "text.txt", "edits.json")  # fmt: skip


class CliTarget:
    """Runs command lines in this process, in a folder of inputs."""

    name = "cli"
    limits = Limits(growth=768 * MIB, address_space=3072 * MIB)

    def prepare(self, seeds: Path, scenes: Path | None) -> None:
        """A small room as scene, session and results, good and damaged."""
        (seeds / "room.glb").write_bytes(small_room().glb())
        (seeds / "room.obj").write_text(obj_text(room(), "room.mtl"))
        (seeds / "room.mtl").write_text(mtl_text(room()))
        os.chdir(seeds)
        outputs = ["room.dlx", "result.npz", "result.csv"]
        code = run(["bake", "room.glb", "--paths", "2000", "--spacing", "0.7", "-q", "-o", *outputs])
        assert code == 0
        for name in ("room.glb", "room.dlx", "result.npz"):
            data = bytearray((seeds / name).read_bytes())
            data[len(data) // 2] ^= 0xFF
            (seeds / f"damaged{Path(name).suffix}").write_bytes(data)
        (seeds / "text.txt").write_text("no scene")
        (seeds / "edits.json").write_text('{"move": {"MOVE_panel": [0.1, 0, 0.1]}, "dim": {"lamp": 0.5}}')

    def load(self, seeds: Path) -> None:
        """Keep them in memory; load what commands load late.

        A library that is interrupted while it loads stays half there for the later cases of a process.
        """
        for module in LOADED_LATE:
            importlib.import_module(module)
        self._inputs = {name: (seeds / name).read_bytes() for name in INPUTS}

    def make(self, rng: Rng, folder: Path) -> None:
        """A folder of inputs and a command line."""
        for name, data in self._inputs.items():
            (folder / name).write_bytes(data)
        (folder / "case.json").write_text(json.dumps(command_line(rng)))

    def run(self, folder: Path) -> None:
        """Run it."""
        words, inputs = json.loads((folder / "case.json").read_text())
        (folder / "folder").mkdir(exist_ok=True)
        (folder / "empty.glb").touch()
        before = {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}
        out, err = stream("strict"), stream("backslashreplace")  # as the interpreter has them
        here = Path.cwd()
        os.chdir(folder)
        try:
            with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err), interrupted():
                code = run(words)
        except KeyboardInterrupt:  # while it ends or prints its error: the program's entry point is quiet
            code = None
        finally:
            os.chdir(here)
        printed, complained = (s.buffer.getvalue().decode() for s in (out, err))
        if code is not None:
            check_outcome(words, code, printed, complained)
        check_files(folder, before, words, inputs)
        shutil.rmtree(folder / "folder")
        if code != 0:
            raise Error(complained.replace("\n", " ") or "cancelled")


def stream(errors: str) -> io.TextIOWrapper:
    """A stream of UTF-8 that is kept."""
    return io.TextIOWrapper(io.BytesIO(), "utf-8", errors, write_through=True)


@contextlib.contextmanager
def interrupted():
    """Ctrl-C after a while."""

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    before = signal.signal(signal.SIGALRM, interrupt)
    signal.setitimer(signal.ITIMER_REAL, INTERRUPTED_AFTER)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)


def check_outcome(words: list[str], code: int, out: str, err: str) -> None:
    """A known exit code, and one line of error exactly where it is not 0."""
    assert code in EXIT_CODES, f"exit code {code}"
    assert "Traceback" not in out + err
    assert "-q" in words or "RuntimeWarning" not in err
    errors = [line for line in err.splitlines() if line.startswith("error: ")]
    helped = code == 2 and len(words) < 2
    watches = "--watch" in words and code in (0, 130)  # it goes on after errors
    assert len(errors) == (code != 0) or helped or watches, (
        f"exit code {code} with {len(errors)} lines of error: {err}"
    )
    assert "NaN" not in out, "NaN in the results"


def check_files(folder: Path, before: dict[str, bytes], words: list[str], inputs: list[str]) -> None:
    """Inputs that no output names are as before; results hold finite numbers; nothing is half-written."""
    for name, data in before.items():
        named = name not in inputs and any(word.endswith(name) for word in words)
        assert named or (folder / name).read_bytes() == data, f"{name} has changed"
    for path in folder.rglob("*"):
        assert ".part" not in path.name, f"{path.name} was left"
    result = folder / "out.npz"
    if result.is_file():
        with np.load(result, allow_pickle=False) as arrays:
            for name in arrays.files:
                if arrays[name].dtype.kind == "f" and name != "gradient":
                    assert np.isfinite(arrays[name]).all(), f"NaN or infinity in {name}"


def small_room() -> GltfBuilder:
    """A floor, a lamp above it, a panel to move."""
    builder = GltfBuilder()
    up = [-(0.5**0.5), 0, 0, 0.5**0.5]  # turns +Z, where builder quads look, to +Y
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    oak = builder.material(name="oak", colour=(0.4, 0.3, 0.2))
    builder.node(name="floor", mesh=builder.quad(grey), rotation=up, translation=[-2, 0, 2], scale=[4, 4, 4])
    builder.node(name="MOVE_panel", mesh=builder.quad(oak), rotation=up, translation=[-1, 0.7, 1])
    lamp = builder.light(name="lamp", type="point", intensity=400.0, color=[1, 1, 1])
    builder.node(name="lamp", translation=[0, 2, 0], extensions=lamp)
    return builder
