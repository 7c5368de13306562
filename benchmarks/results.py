# SPDX-License-Identifier: Apache-2.0
"""Renews tables of RESULTS.md from what benchmarks wrote into benchmarks/out.

    python benchmarks/results.py                  # every table whose file is there
    python benchmarks/results.py engine peers     # these

A table stands between `<!-- table: NAME -->` and `<!-- end of table -->`, under a line with its command, date
and machine. The date is that of the file, the machine is this one: run it where the benchmarks ran. A table
without a file stays as it is.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent / "tests"))
from oracles.metrics import Run, seconds_to  # noqa: E402

Row = Sequence[str]
BLOCK = re.compile(r"(<!-- table: (\S+) -->\n).*?(<!-- end of table -->)", re.DOTALL)
PROGRAMS = {"deltalux": "Deltalux", "mitsuba": "Mitsuba 3", "radiance": "Radiance"}
MIB = 2**20


@dataclass(frozen=True)
class Table:
    """Where figures come from, and how they become rows, of which the first is the header."""

    file: str
    command: str
    rows: Callable[[Any], Iterator[Row]]


def engine(runs: dict[str, Any]) -> Iterator[Row]:
    """What was reached beside what the project required of itself before it was written."""
    base, two, rays = runs["3%"], runs["3%, 2 threads"], runs["gather"]
    yield "figure", "reached", "required"
    yield "paths; segments", f"{base['paths']:,}; {base['segments']:,.0f}", ""
    yield "raw rays / full path tracing", f"{base['raw_over_trace']:.2f}", "≥ 0.60"
    yield "deposit of a segment into 1e5 discs, in raw rays", f"{base['deposit_over_raw']:.2f}", "≤ 0.9"
    search = f"{base['search_ns']:.2f} ns, {base['search_ns'] / base['raw_ray_ns']:.4f} raw rays"
    yield "search for affected segments, per stored segment", search, "≤ 1.0 ns, 0.0043 raw rays"
    yield "of that, the scan", f"{base['scan_ns']:.2f} ns", ""
    yield "moving samples, part of a frame", f"{base['moving_share']:.1%}", "≤ 10 %"
    yield "frame efficiency", f"{base['frame_efficiency']:.2f}", "≥ 0.18"
    yield "bytes per stored segment, everything counted", f"{base['bytes_per_segment']:.1f}", "≤ 64"
    required = {"1%": "≥ 300", "3%": "≥ 80"}
    for name, run in runs.items():
        if name not in ("deposit", "gather"):
            yield f"recompute / frame, object {name}", f"{run['speedup']:.0f}", required.get(name, "")
    for what in ("recompute", "frame"):
        ratio = base[f"{what}_wall_ms"] / two[f"{what}_wall_ms"]
        yield f"{what}, one thread / two threads, wall clock", f"{ratio:.2f}", ""
    yield "gather: a ray and its chain, in raw rays", f"{rays['ray_over_raw']:.1f}", ""
    yield "gather: reading the light of a ray", f"{rays['look_up_ns']:.0f} ns", ""
    yield f"gather: bytes per sample of {rays['rays']} rays", f"{rays['bytes_per_sample']:.0f}", ""
    yield "gather: part of a frame", f"{rays['frame_share']:.0%}", ""
    yield "gather: recompute / frame", f"{rays['speedup']:.0f}", ""
    for entry, most in zip(runs["deposit"]["results"], ("≤ 0.9", "≤ 1.5"), strict=False):
        discs = f"deposit alone into {entry['discs']:,} discs"
        yield f"{discs}, in raw rays", f"{entry['deposit_in_rays']:.2f}", most
        yield f"{discs}, faster than Embree's discs", f"{entry['faster_than_embree_discs']:.1f}", "≥ 2"
    exact = all(run.get("exact", True) for run in runs.values())
    yield "frames equal a recompute to the bit", "yes" if exact else "NO", "yes"


def updates(found: dict[str, Any]) -> Iterator[Row]:
    """The slower of the two updates of each object, by default options."""
    yield "scene, object", "samples", "gather rays", "recompute", "recompute / update", "rays cast again"
    for source, scene in found["scenes"].items():
        size = f"{scene['samples']:,}", f"{scene['rays']:,}", f"{scene['recompute']:.1f} s"
        for name, steps in scene["updates"].items():
            ratio = scene["recompute"] / max(step["seconds"] for step in steps)
            again = max(step["rays"] for step in steps) / max(1, scene["rays"])
            yield f"{Path(source).stem}, {name}", *size, f"{ratio:.1f}", f"{again:.1%}"


def peers(result: dict[str, Any]) -> Iterator[Row]:
    """Processor seconds to an error in the office."""
    required = {"before 5%": "≥ 8", "before 2%": "≥ 15", "after 2%": "≥ 800"}
    names = [name for name in PROGRAMS if name in result["runs"]]
    yield "error", *(PROGRAMS[name] for name in names), "times sooner", "required"
    for key, row in result["summary"].items():
        state, target = key.split()
        what = {"before": "bake", "after": "moved chair"}[state]
        values = (_or_dash(row.get(name)) for name in (*names, "times sooner"))
        yield f"{what}, {target}", *values, required.get(key, "")


def peers_in_rooms(table: dict[str, Any]) -> Iterator[Row]:
    """Processor seconds to an error in the rooms of contacts and of spots."""
    targets = (0.05, 0.02, 0.01)
    names = [name for name in PROGRAMS if any(name in runs for runs in table.values())]
    yield "room, part, error", *(PROGRAMS[name] for name in names)
    for room, runs in table.items():
        for part in ("static", "small", "change"):
            cells = []
            for name in names:
                rows = runs.get(name, {}).get("change" if part == "change" else "light", [])
                own = [Run(row["setting"], row["seconds"], _worst(row[part])) for row in rows]
                times = (seconds_to(target, own, extrapolate=name != "deltalux") for target in targets)
                cells.append(" / ".join(map(_or_dash, times)))
            yield f"{room}, {part}, 5 / 2 / 1 %", *cells


def contacts(table: dict[str, Any]) -> Iterator[Row]:
    """Errors in rooms with contacts, the worst of the seeds."""
    runs: dict[tuple[str, Any, int], list[dict[str, Any]]] = {}
    for key, run in table.items():
        runs.setdefault((key.split()[0], run["gather"], run["paths"]), []).append(run)
    yield (
        "room",
        "rays, paths",
        "seeds",
        "static",
        "bias",
        "small",
        "on what moves",
        "change, per move",
        "bake",
    )
    for (room, rays, paths), own in runs.items():
        errors = [_percent(max(run[part]["rms"] for run in own)) for part in ("static", "small", "receivers")]
        bias = max((run["static"]["bias"] for run in own), key=abs)
        moves = zip(*(run["moves"] for run in own), strict=True)
        changes = ", ".join(_percent(max(row["change_error"] for row in same)) for same in moves)
        seconds = max(run["bake_seconds"] for run in own)
        seeds = ", ".join(str(run["seed"]) for run in own)
        cells = errors[0], _percent(bias), *errors[1:], changes, f"{seconds:.1f} s"
        yield room, f"{'discs' if rays == 'off' else rays}, {paths:,}", seeds, *cells


def claimed_error(rows: list[dict[str, Any]]) -> Iterator[Row]:
    """Claimed error over true error."""
    yield "scene", "rays", "true median", "claimed / true", "true 90th percentile", "claimed / true"
    for row in rows:
        cells: list[str] = []
        for quantile in ("median", "p90"):
            true, claimed = row["true"][quantile], row["claimed"][quantile]
            cells += [_percent(true), f"{claimed / true:.2f}"]
        yield row["scene"], str(row["gather"]), *cells


def memory(rows: list[dict[str, Any]]) -> Iterator[Row]:
    """Peak memory of bakes, and its forecast."""
    yield "scene", "triangles", "samples", "paths", "rays", "peak MiB", "forecast / peak", "saving adds, MiB"
    for row in rows:
        counts = (f"{row[key]:,}" for key in ("triangles", "samples", "paths", "rays"))
        peak, ratio = f"{row['peak'] / MIB:,.0f}", f"{row['forecast'] / row['peak']:.2f}"
        yield Path(row["scene"] or "hall").stem, *counts, peak, ratio, f"{row['saving'] / MIB:.0f}"


def time_left(found: dict[str, Any]) -> Iterator[Row]:
    """How often the time left that the bar tells is off by at most half, and by how much at 90 %."""
    yield "scene, command, clock, threads", "seconds", "within half", "90 % quantile", "longest silence"
    for key, row in found.items():
        cells = f"{row['within']:.2f}", f"{row['quantiles']['90']:.2f}", f"{row['silent']:.1f} s"
        yield ", ".join(key.rsplit(maxsplit=3)), f"{row['seconds']:.0f}", *cells


def latency(results: list[dict[str, Any]]) -> Iterator[Row]:
    """From sending a pose to having applied values that include it."""
    yield "session", "samples", "poses", "updates a second (≥ 10)", "median", "95 % (< 250 ms)", "exact after"
    names = {"lock step": "when a frame arrives", "30 a second": "30 a second"}
    for row in results:
        for mode in row["modes"]:
            times = (f"{mode[f'{q}_milliseconds']:.0f} ms" for q in ("p50", "p95"))
            rate, exact = (
                f"{mode['frames_per_second']:.1f}",
                f"{mode['at_rest']['seconds_until_exact']:.1f} s",
            )
            yield row["name"], f"{row['samples']:,}", names[mode["mode"]], rate, *times, exact


def soak(found: dict[str, Any]) -> Iterator[Row]:
    """Three clients at work on one view."""
    own = found["summary"]
    yield "figure", "reached"
    yield "minutes; actions", f"{own['minutes']:.0f}; {sum(own['actions'].values()):,}"
    yield "checks; all digests equal", f"{own['checks']}; {'yes' if own['same'] else 'NO'}"
    memory = (f"{own[f'mib_{when}']:,.0f}" for when in ("first", "last", "most"))
    yield "resident memory, first, last, most", f"{', '.join(memory)} MiB"
    slope, error = own["mib_a_minute"], own["mib_a_minute_error"]
    yield "its slope after the first quarter", f"{slope:+.1f} ± {error:.1f} MiB a minute"
    thirds = (f"{own[f'p95_{which}_third']:.0f}" for which in ("first", "last"))
    yield "95 % latency, first and last third", f"{', '.join(thirds)} ms"


TABLES = {
    "engine": Table("bench.json", "make bench", engine),
    "updates": Table("default_updates.json", "python benchmarks/default_updates.py SCENE…", updates),
    "peers": Table("peers.json", "make bench-peers", peers),
    "peers-in-rooms": Table("peers_rooms.json", "make bench-peers", peers_in_rooms),
    "contacts": Table("contacts.json", "python benchmarks/peers/contacts.py", contacts),
    "claimed-error": Table("claimed_error.json", "python benchmarks/claimed_error.py SCENE…", claimed_error),
    "memory": Table("forecast.json", "python benchmarks/forecast.py", memory),
    "time-left": Table("eta.json", "python benchmarks/eta.py SCENE…", time_left),
    "latency": Table("viewer_latency.json", "python benchmarks/viewer_latency.py", latency),
    "soak": Table("viewer_soak.json", "make soak", soak),
}


def _percent(value: float) -> str:
    return f"{100 * value:.1f} %"


def _or_dash(value: float | None) -> str:
    return "-" if value is None else f"{value:.3g}" if value < 1000 else f"{value:,.0f}"


def _worst(errors: float | list[float]) -> float:
    return max(errors) if isinstance(errors, list) else errors


def machine() -> str:
    """The processor's name and how many there are, as Linux tells it."""
    about = Path("/proc/cpuinfo")
    text = about.read_text(encoding="utf-8") if about.exists() else ""
    name = re.search(r"^model name\s*: (.*)$", text, re.MULTILINE)
    wide = " with AVX-512" if "avx512f" in text else ""
    return f"{name[1].strip() if name else platform.machine()}{wide}, {os.cpu_count()} processors"


def block(table: Table, file: Path) -> str:
    """The lines of a table, with where its figures come from."""
    made = date.fromtimestamp(file.stat().st_mtime).isoformat()
    header, *rows = table.rows(json.loads(file.read_text(encoding="utf-8")))
    lines = (f"| {' | '.join(row)} |" for row in (header, ["---"] * len(header), *rows))
    return "\n".join([f"`{table.command}`, {made}, {machine()}:", "", *lines, ""])


def renewed(text: str, folder: Path, names: Sequence[str]) -> tuple[str, dict[str, bool]]:
    """The page with new tables, and of each table that it has, whether it is new."""
    new: dict[str, bool] = {}

    def replace(match: re.Match[str]) -> str:
        begin, name, end = match.groups()
        table = TABLES.get(name)
        new[name] = table is not None and name in names and (folder / table.file).exists()
        return f"{begin}\n{block(table, folder / table.file)}\n{end}" if table and new[name] else match[0]

    return BLOCK.sub(replace, text), new


def main() -> int:
    """Renew the page, and say what was done."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("tables", nargs="*", help=f"of {', '.join(TABLES)}; all if none is named")
    parser.add_argument("--page", type=Path, default=HERE / "RESULTS.md")
    parser.add_argument("--out", type=Path, default=HERE / "out", help="folder with the benchmarks' files")
    options = parser.parse_args()
    if unknown := set(options.tables) - set(TABLES):
        parser.error(f"found no table {', '.join(sorted(unknown))}, expected some of {', '.join(TABLES)}")
    names = options.tables or list(TABLES)
    text, new = renewed(options.page.read_text(encoding="utf-8"), options.out, names)
    if strange := set(new) ^ set(TABLES):
        wrong = ", ".join(sorted(strange))
        print(f"{options.page}: tables {wrong} are unknown or missing, expected {', '.join(TABLES)}")
        return 1
    options.page.write_text(text, encoding="utf-8")
    for name in names:
        print(f"{name}: {'renewed' if new[name] else f'no {TABLES[name].file}, as it was'}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
