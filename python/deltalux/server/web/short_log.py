# SPDX-License-Identifier: Apache-2.0
"""Keeps the log of the server short and free of tokens, whatever strangers send."""

from __future__ import annotations

import asyncio
import logging
import re
import time
from collections.abc import Callable
from typing import Any

QUIET_SECONDS = 60.0  # between two lines of one text
# uvicorn logs this as an error after each answer of 403, although the answer was intended.
REFUSAL_OF_THE_LIBRARY = "ASGI callable returned without completing handshake."
LOGGER = logging.getLogger("deltalux.server")
_OF_UVICORN = logging.getLogger("uvicorn.error")
_TOKEN = re.compile(r"(token=)[^\s&\"']+")


def without_tokens(text: str) -> str:
    """The text, with … for each token in an address."""
    return _TOKEN.sub(r"\1…", text)


class Seldom:
    """Passes each text once in a while, with the number of those that were left out.

    Parameters
    ----------
    seconds : between two lines of one text
    clock : seconds from any beginning
    """

    def __init__(self, seconds: float = QUIET_SECONDS, clock: Callable[[], float] = time.monotonic) -> None:
        self._seconds, self._clock = seconds, clock
        self._told: dict[str, tuple[float, int]] = {}  # by text: when it was told, how many were not since

    def line(self, text: str) -> str | None:
        """What to tell of this text now; None: nothing."""
        now = self._clock()
        then, left_out = self._told.get(text, (-self._seconds, 0))
        if now - then < self._seconds:
            self._told[text] = then, left_out + 1
            return None
        recent = {t: entry for t, entry in self._told.items() if now - entry[0] < self._seconds}
        self._told = {**recent, text: (now, 0)}
        return f"{text} ({left_out} more of these before)" if left_out else text


def keep_short() -> None:
    """Let uvicorn tell little: see `_is_worth_a_line`."""
    _OF_UVICORN.addFilter(_is_worth_a_line)  # the same function is added only once


def keep_loop_short(loop: asyncio.AbstractEventLoop) -> None:
    """Let an event loop tell of failures in one line: without files left, it fails to accept in thousands."""
    seldom = Seldom()

    def tell(_: asyncio.AbstractEventLoop, context: dict[str, Any]) -> None:
        error = context.get("exception")
        if line := seldom.line(f"{context['message']}" + (f": {error}" if error else "")):
            LOGGER.warning(line, exc_info=None if isinstance(error, OSError) else error)

    loop.set_exception_handler(tell)


_warnings = Seldom()


def _is_worth_a_line(record: logging.LogRecord) -> bool:
    """Whether to log a record; takes tokens out of its text.

    Not: refusals, tracebacks of texts that are not UTF-8 (close code 1007), and warnings, which come from
    requests that are none, again and again.
    """
    text = record.getMessage()
    if text == REFUSAL_OF_THE_LIBRARY or (
        record.exc_info and isinstance(record.exc_info[1], UnicodeDecodeError)
    ):
        return False
    if record.levelno == logging.WARNING:
        line = _warnings.line(text)
        if line is None:
            return False
        text = line
    record.msg, record.args = without_tokens(text), ()
    return True
