# SPDX-License-Identifier: Apache-2.0
"""Measures error and leak of every rule: where a segment ends, which area a disc counts.

Prints the tables of docs/explanation/segment-ends.md. The cases and their references are those of the tests.
"""

from __future__ import annotations

import argparse
import sys
from itertools import product
from pathlib import Path

import deltalux as dl
import numpy as np

TESTS = Path(__file__).resolve().parents[1] / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "python")]
from scenes_for_tests import Case, bowl_case, corner_case, rooms_case  # noqa: E402

CASES = {
    "Hemispherical bowl, smooth normals": lambda: bowl_case(smooth=True),
    "Hemispherical bowl, facetted": lambda: bowl_case(smooth=False),
    "Corner, walls of zero thickness": lambda: corner_case(0.0),
    "Corner, walls of 10 cm": lambda: corner_case(0.1),
    "Two rooms, wall of one polygon": rooms_case,
}
DEFAULT = {"direct": "auto"}
RULES = [
    {"direct": "paths", "disc_area": area, "segment_end": end}
    for area, end in product(("reachable", "whole"), ("first", "bounded", "second"))
]


def irradiance(scene: dl.Scene, samples: dl.Samples, **options) -> np.ndarray:
    """(n,) first channel of a bake."""
    with dl.Session(scene, samples, gather="off", **options) as session:
        session.bake()
        return session.irradiance[:, 0]


def row(case: Case, rule: dict[str, str], **options) -> str:
    """Mean errors by place, RMS error of all samples, mean and greatest leak; percent."""
    lit = irradiance(case.lit, case.samples, **rule, **options)
    error = 100 * (lit / case.reference - 1)
    leak = 100 * irradiance(case.other, case.samples, **rule, **options) / case.reference.mean()
    name = "defaults" if rule is DEFAULT else f"{rule['disc_area']}, {rule['segment_end']}"
    cells = [f"{round(error[place].mean(), 1) + 0.0:+.1f}" for place in case.places.values()]  # never -0.0
    cells += [f"{np.sqrt((error**2).mean()):.1f}", _percent(leak.mean()), _percent(leak.max())]
    return f"| {name} | " + " | ".join(cells) + " |"


def _percent(value: float) -> str:
    if value == 0:
        return "0"
    return f"{value:.0f}" if value >= 10 else f"{value:.2g}"


def main() -> None:
    """Print one Markdown table per case."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--paths", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    options = vars(parser.parse_args())
    for name, make in CASES.items():
        case = make()
        heads = [*(f"error, {place}" for place in case.places), "RMS error", "leak, mean", "leak, most"]
        print(f"### {name}\n\n| rule | " + " | ".join(heads) + " |")
        print("| --- |" + " ---: |" * len(heads))
        for rule in [DEFAULT, *RULES]:
            print(row(case, rule, **options), flush=True)
        print()


if __name__ == "__main__":
    main()
