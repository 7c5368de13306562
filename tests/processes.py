# SPDX-License-Identifier: Apache-2.0
"""Helpers of tests that start programs and interrupt them."""

from __future__ import annotations

import signal


def listen_to_interrupts() -> None:
    """In a new process: what a script starts in its background has Ctrl-C ignored."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
