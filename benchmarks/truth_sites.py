# SPDX-License-Identifier: Apache-2.0
"""Claimed error against truth on two sites: a house on land, a courtyard with façades.

    PYTHONPATH=python python benchmarks/truth_sites.py --seeds 4

Light of points in rooms and outside, all in one session, against the path tracer of tests/oracles, which
shares no code; over sessions of several seeds. Prints by group of points: the mean difference, and |error|
over claimed error at the median and at nine tenths, over the normal's. Claimed and traced errors are added as
variances; where the traced one is the larger, the quantiles say little: give the tracer more `--seconds`.
Exit 1 if the 90th percentile of a group is beyond a quarter of the normal's, or a group is wrong.
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "python")]
from builders.truth_draft import Draft, Truth  # noqa: E402
from builders.truth_places import PLACES  # noqa: E402
from oracles.truth_verdict import NORMAL, judge, trace_and_judge  # noqa: E402

TOLERANCE = 0.25
SEED = 5  # of the sites: places of furniture and points


def groups_of(site: str, count: int) -> dict[str, Truth]:
    """The same scene for each group of points."""
    found = {}
    for name in PLACES[site](Draft(), np.random.default_rng(SEED)):
        draft, rng = Draft(), np.random.default_rng(SEED)
        draft.planes = PLACES[site](draft, rng)[name]
        draft.unmeasure()
        found[name] = draft.finished(site, rng, count)
    return found


def sessions(groups: dict[str, Truth], seeds: int, options: dict[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(seeds, all points) light and claimed error."""
    scene = next(iter(groups.values())).scene
    points, normals = (
        np.concatenate([getattr(g, part) for g in groups.values()]) for part in ("points", "normals")
    )
    light, error = [], []
    for seed in range(seeds):
        with dl.Session(scene, dl.Samples(points, normals), seed=seed, **options) as session:
            session.bake()
            values, errors = session.read()
        light.append(values[:, 1]), error.append(errors[:, 1])
        print(f"  baked {seed + 1} of {seeds}", flush=True)
    return np.array(light), np.array(error)


def examine(site: str, options: argparse.Namespace) -> list[dict[str, Any]]:
    groups = groups_of(site, options.points)
    given = {name: value for name in ("paths", "gather") if (value := getattr(options, name)) is not None}
    light, error = sessions(groups, options.seeds, given)
    rows, first = [], 0
    for name, truth in groups.items():
        own = slice(first, first + options.points)
        first += options.points
        places = (truth.points, truth.normals)
        _, traced = trace_and_judge(
            truth.world, places, light[0, own], error[0, own], seed=SEED, seconds=options.seconds
        )
        verdicts = [judge(a, b, traced) for a, b in zip(light[:, own], error[:, own], strict=True)]
        beyond = np.concatenate([v.beyond for v in verdicts])
        rows.append({
            "site": site, "group": name, "bias": float(np.mean([v.bias for v in verdicts])),
            "outside": float(np.mean([v.outside for v in verdicts])),
            "claimed": float(np.median([v.claimed for v in verdicts])), "traced": verdicts[0].traced,
            "wrong": sum(v.wrong for v in verdicts), "lies": sum(v.lies for v in verdicts),
            **{f"p{share:.0%}"[:-1]: float(np.quantile(beyond, share) / NORMAL[share]) for share in NORMAL},
        })  # fmt: skip
        print(line(rows[-1], options.seeds), flush=True)
    return rows


def line(row: dict[str, Any], seeds: int) -> str:
    """One group in words."""
    return (
        f"{row['site']}, {row['group']}: bias {row['bias']:+.2%}, {row['outside']:.1%} of points outside, "
        f"claimed {row['claimed']:.2%}, traced {row['traced']:.2%}; error/claimed over the normal's: p50 "
        f"{row['p50']:.2f}, p90 {row['p90']:.2f}; wrong {row['wrong']}, lies {row['lies']} of {seeds} seeds"
    )


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("sites", nargs="*", default=list(PLACES), help=f"of {', '.join(PLACES)}")
    parser.add_argument("--points", type=int, default=200, help="of each group")
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--paths", type=int, help="of the session; default: its own")
    parser.add_argument("--gather", type=int, help="rays of the session; default: its own")
    parser.add_argument("--seconds", type=float, default=120.0, help="of the path tracer, for one group")
    parser.add_argument("--json", type=Path, help="write all figures to this file")
    options = parser.parse_args()
    rows = [row for site in options.sites for row in examine(site, options)]
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(rows, indent=1))
    return int(any(row["wrong"] or abs(row["p90"] - 1) > TOLERANCE for row in rows))


if __name__ == "__main__":
    sys.exit(main())
