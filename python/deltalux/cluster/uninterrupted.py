# SPDX-License-Identifier: Apache-2.0
"""Preloaded by workers of this machine: Ctrl-C is for the command that started them, which ends them."""

from __future__ import annotations

import signal
from typing import Any


def dask_setup(worker: Any) -> None:
    """Called by Dask when the worker starts."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
