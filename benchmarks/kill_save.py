# SPDX-License-Identifier: Apache-2.0
"""Kills processes that save, or export, at random instants: the file is the old one or the new one, whole.

    PYTHONPATH=python .venv/bin/python benchmarks/kill_save.py --kills 1000 --exports 250

Each child opens one of two sessions and writes it over the other's file until `kill -9` meets it.
Instants are spread evenly from the moment when the new file is opened to a little after the time that a
write takes. A file counts as whole where it equals, byte by byte (.npz: array by array), one that was
opened and read before the first kill.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import sys
import tempfile
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux import files
from deltalux.outputs import write
from deltalux.outputs.images import Picture
from deltalux.outputs.of_session import baked_of
from PIL import Image

SESSION = ".dlx"
EXPORTS = (".glb", ".npz", ".csv", ".png")
VERSIONS = ("a", "b")
# Nothing to plan, so that children soon come to their writing.
QUICK = {"threads": 1, "direct": "paths", "static_method": "disc_index", "moving_method": "disc_index"}
BEYOND = 1.2  # of the time that a write takes


def make_sessions(folder: Path) -> None:
    """Two states of one room, each as a session and as every export, opened and read back."""
    scene = dl.scenes.cornell_box()
    for name, seed in zip(VERSIONS, (1, 2), strict=True):
        samples = dl.Samples.on_vertices(scene, spacing=1.0)
        with dl.Session(scene, samples, paths=30_000, seed=seed, **QUICK) as session:
            session.bake()
            session.save(folder / f"{name}{SESSION}")
            with dl.Session.open(folder / f"{name}{SESSION}", threads=1) as opened:
                assert opened.digest() == session.digest()
            for suffix in EXPORTS:
                write_export(folder / f"{name}{suffix}", session)
            with Image.open(folder / f"{name}.png") as image:
                image.load()


def write_export(file: Path, session: dl.Session) -> None:
    """What the command line writes, but for the picture: drawing takes seconds with nothing to kill."""
    if file.suffix == ".png":
        rng = np.random.default_rng(session.options["seed"])
        Picture(rng.integers(0, 255, (600, 900, 3), np.uint8)).save(file)
    else:
        write(file, baked_of(session, "kill_save"))


def content(path: Path) -> object:
    """What makes two files equal; NumPy dates the entries of its archives."""
    if path.suffix != ".npz":
        return path.read_bytes()
    with np.load(path) as arrays:
        return {name: arrays[name].tobytes() for name in arrays}


def child(source: Path, target: Path, tell: int) -> None:
    """Open `source`, write it to `target`, and say when."""

    class Announced(files._Aside):
        def __init__(self, *place: Any) -> None:
            os.write(tell, b"r")
            super().__init__(*place)

    files._Aside = Announced
    session = dl.Session.open(source, threads=1)
    if target.suffix == SESSION:
        session.save(target)
    else:
        write_export(target, session)
    os.write(tell, b"w")
    time.sleep(3600)


def start(source: Path, target: Path) -> tuple[int, int]:
    """Fork a child; return its process and the end of its pipe, once it is about to write."""
    hear, tell = os.pipe()
    process = os.fork()
    if process == 0:
        try:
            os.close(hear)
            child(source, target, tell)
        finally:
            os._exit(1)
    os.close(tell)
    if os.read(hear, 1) != b"r":
        raise RuntimeError(f"the child that should write {target.name} failed")
    return process, hear


def kill(process: int, hear: int) -> bool:
    """Kill a child; return whether its write had returned."""
    os.kill(process, signal.SIGKILL)
    os.waitpid(process, 0)
    returned = os.read(hear, 1) == b"w"
    os.close(hear)
    return returned


@dataclass
class Counts:
    """What was found after the kills of one kind of file."""

    during: int = 0  # kills before the write had returned
    old: int = 0
    new: int = 0
    left_over: int = 0  # files beside the target
    broken: list[str] = field(default_factory=list)


def try_kills(folder: Path, suffix: str, count: int, rng: np.random.Generator) -> Counts:
    """Kill `count` writers of one kind."""
    known = {name: content(folder / f"{name}{suffix}") for name in VERSIONS}
    place = folder / f"in{suffix.replace('.', '_')}"
    place.mkdir()
    target, present = place / f"target{suffix}", "a"
    target.write_bytes((folder / f"a{suffix}").read_bytes())
    counts = Counts()
    duration = measured(folder, target)
    for number in range(count):
        other = "b" if present == "a" else "a"
        process, hear = start(folder / f"{other}{SESSION}", target)
        time.sleep(rng.uniform(0, BEYOND * duration))
        counts.during += not kill(process, hear)
        try:
            found = content(target)
        except Exception as error:
            found = f"{type(error).__name__}: {error}"
        if found not in known.values():
            counts.broken.append(f"{target.name}, kill {number}: {found!r:.100}")
            target.write_bytes((folder / f"{present}{suffix}").read_bytes())
        elif found == known[present]:
            counts.old += 1
        else:
            counts.new, present = counts.new + 1, other
        for left in set(place.iterdir()) - {target}:
            counts.left_over += 1
            left.unlink()
    return counts


def measured(folder: Path, target: Path) -> float:
    """Seconds that a write of what `target` holds takes; the median of five."""
    times = []
    for _ in range(5):
        process, hear = start(folder / f"a{SESSION}", target)
        begin = time.perf_counter()
        os.read(hear, 1)
        times.append(time.perf_counter() - begin)
        kill(process, hear)
    return float(np.median(times))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--kills", type=int, default=1000, help="of processes that save")
    parser.add_argument("--exports", type=int, default=250, help="of processes that export, per kind of file")
    parser.add_argument("--seed", type=int, default=1)
    options = parser.parse_args()
    rng = np.random.default_rng(options.seed)
    whole = total = 0
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        # Elsewhere: what forks has no threads of its own.
        maker = multiprocessing.get_context("spawn").Process(target=make_sessions, args=(folder,))
        maker.start()
        maker.join()
        for suffix, count in ((SESSION, options.kills), *((suffix, options.exports) for suffix in EXPORTS)):
            if not count:
                continue
            counts = try_kills(folder, suffix, count, rng)
            print(
                f"{suffix}: {count} kills, {counts.during} of them during the write; {counts.old} times "
                f"the old file, {counts.new} times the new one, {len(counts.broken)} broken ones, "
                f"{counts.left_over} left over",
                flush=True,
            )
            for text in counts.broken:
                print(text)
            whole, total = whole + counts.old + counts.new, total + count
    print(f"whole: {whole} of {total}")
    return 0 if whole == total else 1


if __name__ == "__main__":
    sys.exit(main())
