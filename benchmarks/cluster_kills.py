# SPDX-License-Identifier: Apache-2.0
"""Kills workers at random instants of bakes and updates; each call must end with the bits of one process.

PYTHONPATH=python .venv/bin/python benchmarks/cluster_kills.py --kills 50
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

TESTS = Path(__file__).resolve().parent.parent / "tests"
sys.path[:0] = [str(TESTS), str(TESTS / "python")]

from cluster.killing import kills, quick_workers  # noqa: E402


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--shards", type=int, default=4)
    asked = parser.parse_args()
    bad = lost = 0
    slowest = 0.0
    with quick_workers() as client:
        for number, one in enumerate(kills(client, asked.kills, asked.seed, asked.shards)):
            bad += not one.right
            lost += one.lost
            slowest = max(slowest, one.seconds)
            print(
                f"{number:3} {one.call:6} killed after {one.after:6.3f} s: {one.lost} shards lost, "
                f"{one.seconds:6.2f} s, {'equal' if one.right else 'OTHER BITS'}",
                flush=True,
            )
    print(f"{asked.kills} kills: {bad} wrong, {lost} shards lost, the slowest call took {slowest:.1f} s")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
