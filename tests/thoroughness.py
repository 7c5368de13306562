# SPDX-License-Identifier: Apache-2.0
"""How many cases the tests that draw them try: few in `make test`, all in `make test-thorough`."""

from __future__ import annotations

import os
from collections.abc import Iterator

SHARE = float(os.environ.get("DELTALUX_THOROUGHNESS", "0.3"))


def examples(most: int) -> int:
    """This share of so many, at least two."""
    return max(2, round(SHARE * most))


def calls() -> Iterator[int]:
    """Numbers of the call that is to fail, from the first on, without end: some of many, or all of them."""
    k = 1
    while True:
        yield k
        k += 1 if SHARE >= 1 else 1 + k // 4
