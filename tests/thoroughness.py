# SPDX-License-Identifier: Apache-2.0
"""How many cases the tests that draw them try: few in `make test`, all in `make test-thorough`."""

from __future__ import annotations

import os

SHARE = float(os.environ.get("DELTALUX_THOROUGHNESS", "0.3"))


def examples(most: int) -> int:
    """This share of so many, at least two."""
    return max(2, round(SHARE * most))
