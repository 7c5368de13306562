# SPDX-License-Identifier: Apache-2.0
"""Writes tests/slow.txt, the tests that `make test` leaves out, from what `pytest --durations=0` printed.

    pytest -n 2 --dist worksteal --durations=0 --durations-min=0.3 > durations.txt
    python tools/slow_tests.py < durations.txt

Files whose tests share much set-up are left out as a whole. Those of tests/promises.txt are run all the same.
"""

from __future__ import annotations

import re
import sys
from collections import defaultdict
from collections.abc import Iterable
from pathlib import Path

LIST = Path(__file__).parents[1] / "tests" / "slow.txt"
LONG = 0.5  # seconds of a test
LONG_SETUP = 4.0  # seconds of what the tests of a file share
LINE = re.compile(r"\s*([\d.]+)s (call|setup|teardown)\s+(tests/.+)")


def slow_tests(lines: Iterable[str]) -> list[str]:
    """Return names of files and of tests, in order."""
    calls: defaultdict[str, float] = defaultdict(float)
    shared: defaultdict[str, float] = defaultdict(float)
    for line in lines:
        if match := LINE.fullmatch(line.rstrip()):
            seconds, kind, name = float(match[1]), match[2], match[3]
            if kind == "call":
                calls[name] += seconds
            else:
                shared[name.partition("::")[0]] += seconds
    files = {name for name, seconds in shared.items() if seconds >= LONG_SETUP}
    tests = {name for name, seconds in calls.items() if seconds >= LONG}
    return sorted(files | {name for name in tests if name.partition("::")[0] not in files})


def main() -> None:
    """Read standard input."""
    names = slow_tests(sys.stdin)
    if not names:
        sys.exit("error: found no durations; give what pytest --durations=0 printed")
    LIST.write_text("".join(f"{name}\n" for name in names), encoding="utf-8")
    print(f"{LIST}: {len(names)} files and tests")


if __name__ == "__main__":
    main()
