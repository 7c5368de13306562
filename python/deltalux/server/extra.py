# SPDX-License-Identifier: Apache-2.0
"""Checks that the libraries of the extra `view` are installed."""

from __future__ import annotations

from importlib.util import find_spec

from deltalux.errors import Error

NEEDED = ("starlette", "uvicorn", "websockets")


def check_extra(what: str) -> None:
    """Raise Error if the extra is not installed; `what` names the function that needs it."""
    if missing := [name for name in NEEDED if find_spec(name) is None]:
        raise Error(f'{what}: found no module {missing[0]}, expected the extra; pip install "deltalux[view]"')
