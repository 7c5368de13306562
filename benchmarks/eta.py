# SPDX-License-Identifier: Apache-2.0
"""Whether the overall bar tells the truth: its time left against what was left, and its longest silence.

    PYTHONPATH=python python benchmarks/eta.py office atrium room.glb
    PYTHONPATH=python python benchmarks/eta.py --clock cpu --fit office expo

Each scene is baked (session, picture and mesh), updated (its first movable moves) and rendered by the
command line, in child processes; `page` is a first bake with previews, as the viewer's pages are told of it,
and `remake` the bake that makes something movable. Ten times a second the estimate is taken down as the bar
would show it.
Between a tenth and nine tenths of the time, `within` is the share of instants at which the time left is
off by at most half of what was left; then quantiles of |told / true - 1|, the longest time without an
update of the bar (silent) and without news from the work (unheard), seconds of wall time, and the time from
the program's start to its first bar. With `--clock cpu` estimates and truth are processor seconds, for
machines on which others work. `--fit` prints each step's time over its forecast. Writes
benchmarks/out/eta.json.
"""

from __future__ import annotations

import argparse
import json
import os
import pty
import select
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.pace import Overall, Step
from deltalux.server.engine import Engine
from deltalux.server.engine.events import Phase
from deltalux.server.engine.remaking import movable

OUT = Path(__file__).resolve().parent / "out" / "eta.json"
CLOCKS = {"wall": time.perf_counter, "cpu": time.process_time}
VERBS = ["page", "remake", "bake", "update", "render", "discs", "target"]
INTERVAL = 0.1  # seconds, as the terminal's bar is drawn
FROM, TO, GOOD = 0.1, 0.9, 0.5


class Recorded(Overall):
    """Keeps how long each step took, and when there was news."""

    def __init__(self, steps: list[Step], clock: Any) -> None:
        self.steps: list[tuple[str, str, float, float]] = []
        self.news: list[float] = [time.perf_counter()]
        self._last: tuple[str, float] = ("", 0.0)
        super().__init__(steps, clock)

    def _leave(self) -> None:
        if self._now:
            own = self._now
            self.steps.append((own.name, own.kind, own.seconds, self._clock() - self._since))
        super()._leave()

    def _hear(self, stage: str, fraction: float) -> None:
        if (stage, fraction) != self._last:
            self.news.append(time.perf_counter())
            self._last = (stage, fraction)

    def begin(self, name: str) -> None:
        self._hear(name, 0.0)
        super().begin(name)

    def __call__(self, stage: str, fraction: float) -> bool:
        self._hear(stage, fraction)
        return super().__call__(stage, fraction)


def run_one(words: list[str], clock_name: str) -> dict[str, Any]:
    """One command in this process, its bar taken down instead of drawn."""
    from deltalux.cli import console, run

    clock = CLOCKS[clock_name]
    rows: list[tuple[float, float, str, float, float]] = []
    kept: dict[str, Any] = {}

    @contextmanager
    def overall(_: Any, steps: list[Step]) -> Iterator[Overall]:
        own = kept["overall"] = Recorded(steps, clock)
        stop = threading.Event()

        def tick() -> None:
            while not stop.wait(INTERVAL):
                now = own.state()
                rows.append((time.perf_counter(), now.elapsed, now.stage, now.share, now.remaining or 0.0))

        thread = threading.Thread(target=tick)
        start, begun = clock(), time.perf_counter()
        thread.start()
        try:
            yield own
        finally:
            kept["seconds"], kept["wall"] = clock() - start, time.perf_counter() - begun
            own.end()
            stop.set()
            thread.join()

    console.Terminal.overall = overall
    code = run([*words, "-q"])
    if code:
        raise SystemExit(code)
    own = kept["overall"]
    return {
        "seconds": kept["seconds"], "wall": kept["wall"], "rows": rows, "steps": own.steps,
        "unforeseen": own.unforeseen, "news": own.news,
    }  # fmt: skip


def run_page(scene: str, threads: int, remake: bool) -> dict[str, Any]:
    """A bake by the engine behind the viewer's page, as pages are told of it; wall time."""
    loaded = dl.load(scene) if "." in scene else getattr(dl.scenes, scene)()
    session = dl.Session(loaded, threads=threads)
    if remake:
        session.bake()
    rows: list[tuple[float, float, str, float, float]] = []
    ready, start = threading.Event(), time.perf_counter()

    def tell(event: Any) -> None:
        now = time.perf_counter()
        if isinstance(event, dict) and event["type"] == "progress":
            rows.append((now, now - start, event["stage"], event["fraction"], event["eta"] or 0.0))
        if event == Phase("ready"):
            ready.set()

    engine = Engine(session, tell)
    engine.start()
    if remake:
        ready.wait()
        ready.clear()
        fixed = max((m for m in loaded.meshes if not m.movable), key=lambda mesh: len(mesh.triangles))
        rows.clear()
        start = time.perf_counter()
        engine.remake(movable(loaded, fixed.name))
    ready.wait()
    seconds = time.perf_counter() - start
    engine.stop()
    return {"seconds": seconds, "rows": rows, "steps": [], "unforeseen": [], "news": [row[0] for row in rows]}


def judged(record: dict[str, Any]) -> dict[str, Any]:
    """Figures of one command."""
    seconds, rows = record["seconds"], record["rows"]
    seen = np.array([row[0] for row in rows])
    spent, left = (np.array([row[k] for row in rows]) for k in (1, 4))
    middle = (spent >= FROM * seconds) & (spent <= TO * seconds)
    true = seconds - spent[middle]
    off = np.abs(left[middle] / true - 1) if middle.any() else np.zeros(1)
    news = np.array(record["news"])
    return {
        "seconds": seconds,
        "within": float((off <= GOOD).mean()),
        "quantiles": {q: float(np.quantile(off, q / 100)) for q in (50, 75, 90, 95)},
        "silent": float(np.diff(seen).max(initial=0.0)),
        "unheard": float(np.diff(news).max(initial=0.0)),
        "unforeseen": record["unforeseen"],
        "steps": record["steps"],
        "rows": [row[1:] for row in rows],
    }


def first_bar(words: list[str]) -> float:
    """Seconds from the start of the program to the first thing on the terminal."""
    master, slave = pty.openpty()
    start = time.perf_counter()
    with subprocess.Popen(
        [sys.executable, "-m", "deltalux_program", *words],
        stdout=subprocess.DEVNULL, stderr=slave, env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    ) as process:  # fmt: skip
        os.close(slave)
        select.select([master], [], [])
        seconds = time.perf_counter() - start
        process.kill()
    os.close(master)
    return seconds


def commands(scene: str, folder: Path, options: argparse.Namespace) -> Iterator[tuple[str, list[str]]]:
    """Verbs and their words; an update needs the session of the bake."""
    threads = ["--threads", str(options.threads)]
    stem = folder / Path(scene).stem
    yield "page", ["page", scene]
    yield "remake", ["remake", scene]
    yield "bake", ["bake", scene, "-o", f"{stem}.dlx", f"{stem}.png", f"{stem}.glb", *threads]
    loaded = dl.load(scene) if "." in scene else getattr(dl.scenes, scene)()
    move = [f"--move={loaded.movable[0]}=0.1,0,0"] if loaded.movable else []
    yield "update", ["update", f"{stem}.dlx", *move, "-o", f"{stem}_moved.png", f"{stem}_moved.npz", *threads]
    yield "render", ["render", scene, "-o", f"{stem}_drawn.png", f"{stem}_drawn.exr", *threads]
    yield "discs", ["bake", scene, "-o", f"{stem}.npz", "--gather", "off", *threads]
    yield "target", ["bake", scene, "-o", f"{stem}.npz", "--target-error", "0.02", *threads]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("scenes", nargs="*", help="bundled scenes or files")
    parser.add_argument("--clock", choices=CLOCKS, default="wall")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--verbs", nargs="*", default=VERBS)
    parser.add_argument("--fit", action="store_true")
    parser.add_argument("--one", nargs="*", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.one:
        words = json.loads(options.one[0])
        if words[0] in ("page", "remake"):
            record = run_page(words[1], options.threads, words[0] == "remake")
        else:
            record = run_one(words, options.clock)
        Path(options.one[1]).write_text(json.dumps(judged(record)))
        return
    found = json.loads(OUT.read_text()) if OUT.exists() else {}
    print(f"{'scene':<18}{'verb':<8}{'s':>7}{'within':>8}{'50 %':>6}{'75 %':>6}{'90 %':>6}{'95 %':>6}"
          f"{'silent':>8}{'unheard':>8}{'first':>7}")  # fmt: skip
    for scene in options.scenes:
        with tempfile.TemporaryDirectory() as folder:
            for verb, words in commands(scene, Path(folder), options):
                if verb not in options.verbs and not (verb == "bake" and "update" in options.verbs):
                    continue
                file = Path(folder) / "record.json"
                child = [
                    sys.executable, __file__, "--clock", options.clock, "--threads", str(options.threads),
                    "--one", json.dumps(words),
                ]  # fmt: skip
                subprocess.run([*child, str(file)], check=True)
                row = json.loads(file.read_text())
                row["first"] = 0.0 if verb in ("page", "remake") else first_bar(words)
                name = Path(scene).stem
                found[f"{name} {verb} {options.clock} {options.threads}"] = row
                off = "".join(f"{value:>6.2f}" for value in row["quantiles"].values())
                print(f"{name:<18}{verb:<8}{row['seconds']:>7.1f}{row['within']:>8.2f}{off}"
                      f"{row['silent']:>8.2f}{row['unheard']:>8.2f}{row['first']:>7.2f}",
                      flush=True)  # fmt: skip
                if row["unforeseen"]:
                    print("   unforeseen:", ", ".join(row["unforeseen"]))
                if options.fit:
                    for step, kind, forecast, took in row["steps"]:
                        print(
                            f"   {step:<22}{kind:<9}{forecast:>9.3f}{took:>9.3f}"
                            f"{took / max(forecast, 1e-3):>8.2f}"
                        )
                OUT.parent.mkdir(parents=True, exist_ok=True)
                OUT.write_text(json.dumps(found))


if __name__ == "__main__":
    main()
