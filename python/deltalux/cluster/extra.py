# SPDX-License-Identifier: Apache-2.0
"""Checks that the libraries of the extra `cluster` are installed."""

from __future__ import annotations

from importlib.util import find_spec

from deltalux.errors import Error

CERTIFICATES = "cryptography"  # which local workers need besides


def check_extra(what: str, *more: str) -> None:
    """Raise Error if the extra is not installed.

    Parameters
    ----------
    what : the function that needs it
    more : modules that it needs besides Dask
    """
    if missing := [name for name in ("distributed", *more) if find_spec(name) is None]:
        raise Error(
            f'{what}: found no module {missing[0]}, expected the extra; pip install "deltalux[cluster]"'
        )
