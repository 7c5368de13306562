# SPDX-License-Identifier: Apache-2.0
"""What `make test` leaves out: slow tests, and most cases of those that draw them."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable, Iterator
from typing import Any

import pytest

SHARE = float(os.environ.get("DELTALUX_THOROUGHNESS", "0.1"))
HALF = os.environ.get("DELTALUX_HALF", "")


def in_other_half(test: str) -> bool:
    """Whether a slow test is left out, if DELTALUX_HALF is a hexadecimal number: odd, or even.

    Tests of a file are of one half, since they share what is slow to make.
    """
    return bool(HALF) and (zlib.crc32(test.partition("::")[0].encode()) ^ int(HALF, 16)) % 2 == 1


def slow(*values: Any) -> Any:
    """Values of `pytest.mark.parametrize` that `make test` leaves out."""
    return pytest.param(*values, marks=pytest.mark.slow)


def all_but_slow(values: Iterable[Any], *short: Any) -> list[Any]:
    """Values of `pytest.mark.parametrize` of which `make test` tries those of `short` only."""
    return [value if value in short else slow(value) for value in values]


def examples(most: int) -> int:
    """This share of so many, at least two."""
    return max(2, round(SHARE * most))


def calls() -> Iterator[int]:
    """Numbers of the call that is to fail, from the first on, without end: some of many, or all of them."""
    k = 1
    while True:
        yield k
        k += 1 + int(0.1 * k * (1 / SHARE - 1))
