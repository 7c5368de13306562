# SPDX-License-Identifier: Apache-2.0
"""Checks that the library of the extra `cluster` is installed."""

from __future__ import annotations

from importlib.util import find_spec

from deltalux.errors import Error


def check_extra(what: str) -> None:
    """Raise Error if the extra is not installed; `what` names the function that needs it."""
    if find_spec("distributed") is None:
        raise Error(
            f'{what}: found no module distributed, expected the extra; pip install "deltalux[cluster]"'
        )
