# SPDX-License-Identifier: Apache-2.0
"""Random scenes of kinds that are hard to get right, each against a path tracer that shares no code.

    PYTHONPATH=python python benchmarks/truth_fuzz.py --scenes 200 --seed 1
    PYTHONPATH=python python benchmarks/truth_fuzz.py --seed 1 --first 37 --scenes 1    # one of them again
    PYTHONPATH=python python benchmarks/truth_fuzz.py --kind opening --scenes 10

A scene is wrong if it is beyond 5 errors and 2 % (tests/oracles/truth_verdict.py says of what, and how often
that happens by chance), its samples or `Session.at` of the same places; it lies if it is wrong with a claimed
error of 0. One line a scene, then a table by kind: |error| over claimed error at the median and at nine
tenths of all points, over the normal's. Exit 1 if more than one scene of 200 is wrong, or one lies.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "python")]
from builders.truth_kinds import KINDS, kind_of, truth_scene  # noqa: E402
from oracles.truth_verdict import NORMAL, judge, trace_and_judge  # noqa: E402


def numbers(first: int, count: int, kind: str | None) -> Iterator[int]:
    """Of the scenes to look at."""
    own = (n for n in itertools.count(first) if kind in (None, kind_of(n)))
    return itertools.islice(own, count)


def examine(seed: int, number: int, options: argparse.Namespace) -> dict[str, Any]:
    """Bake, trace and judge one scene."""
    start = time.process_time()
    truth = truth_scene(seed, number)
    given = {name: value for name in ("paths", "gather") if (value := getattr(options, name)) is not None}
    found = truth.measured(**given)
    places = (truth.points, truth.normals)
    verdict, traced = trace_and_judge(
        truth.world, places, found.light, found.error,
        seed=number, seconds=options.trace_seconds, dark=truth.dark,
    )  # fmt: skip
    asked = judge(found.asked, found.error, traced, truth.dark)
    return {
        "number": number, "kind": truth.kind, "about": truth.about,
        "bias": verdict.bias, "at": asked.bias,
        "allowed": verdict.allowed, "outside": max(verdict.outside, asked.outside),
        "claimed": verdict.claimed, "traced": verdict.traced, "mean": float(traced.mean.mean()),
        "wrong": verdict.wrong or asked.wrong, "lies": verdict.lies or asked.lies,
        "beyond": verdict.beyond.tolist(), "bake_seconds": found.seconds,
        "seconds": time.process_time() - start,
        "p50": verdict.over_normal(0.5), "p90": verdict.over_normal(0.9),
    }  # fmt: skip


def line(row: dict[str, Any], left: float) -> str:
    """One scene in words."""
    verdict = "LIES" if row["lies"] else "WRONG" if row["wrong"] else "right"
    about = ", ".join(f"{key} {value}" for key, value in row["about"].items())
    parts = [
        f"{row['number']:4d} {row['kind']:9s} {verdict:5s}",
        f"bias {row['bias']:+8.2%} (allowed {row['allowed']:.1%}; at {row['at']:+.2%})",
        f"{row['outside']:4.0%} outside",
        f"claimed {row['claimed']:.2%}",
        f"traced {row['traced']:.2%}",
        f"error/claimed {row['p50']:.2f} {row['p90']:.2f}",
        f"{row['mean']:.3g} lx",
        f"bake {row['bake_seconds']:.1f} of {row['seconds']:.1f} s",
        about,
        f"{left:.0f} s left",
    ]
    return "; ".join(parts)


def table(rows: list[dict[str, Any]]) -> str:
    """Wrong scenes and quantiles by kind."""
    lines = ["kind       scenes wrong lies  worst bias  error/claimed p50, p90 over the normal's"]
    for kind in [*dict.fromkeys(row["kind"] for row in rows), "all"]:
        own = [row for row in rows if kind in (row["kind"], "all")]
        beyond = np.concatenate([row["beyond"] for row in own])
        p50, p90 = (np.quantile(beyond, share) / NORMAL[share] for share in (0.5, 0.9))
        worst = max((row["bias"] for row in own), key=abs)
        wrong, lies = (sum(row[key] for row in own) for key in ("wrong", "lies"))
        lines.append(f"{kind:10s} {len(own):6d} {wrong:5d} {lies:4d}   {worst:+9.2%}  {p50:.2f}, {p90:.2f}")
    return "\n".join(lines)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--scenes", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0, help="number of the first scene")
    parser.add_argument("--kind", choices=list(KINDS), help="only scenes of this kind")
    parser.add_argument("--paths", type=int, help="of the session; default: its own")
    parser.add_argument("--gather", type=int, help="rays of the session; default: its own")
    parser.add_argument("--trace-seconds", type=float, default=10.0, help="of the path tracer, for one scene")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    options = parser.parse_args()
    rows: list[dict[str, Any]] = []
    start = time.perf_counter()
    for number in numbers(options.first, options.scenes, options.kind):
        rows.append(examine(options.seed, number, options))
        left = (time.perf_counter() - start) / len(rows) * (options.scenes - len(rows))
        print(line(rows[-1], left), flush=True)
        if options.json:
            options.json.parent.mkdir(parents=True, exist_ok=True)
            options.json.write_text(json.dumps(rows, indent=1))
    print(table(rows))
    wrong, lies = sum(row["wrong"] for row in rows), sum(row["lies"] for row in rows)
    return int(wrong > len(rows) // 200 or lies > 0)


if __name__ == "__main__":
    sys.exit(main())
