# SPDX-License-Identifier: Apache-2.0
"""One connected page: messages that wait to be sent, merged where possible, and frames in flight."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Awaitable, Callable

from .drawn.values import Values
from .protocol.frames import frame_bytes
from .protocol.told import Told

IN_FLIGHT = 2  # frames sent that the page has not acknowledged yet
MAX_WAITING = 1000  # messages that may wait for a page that does not receive them
# a newer message replaces a waiting one of the same type
LATEST_ONLY = ("state", "progress", "frame", "unreached", "geometry")


class Page:
    """Messages and values for one page.

    A page that stalls costs no memory: only the newest values are kept, and a frame holds their difference
    to the values that the page has.

    Parameters
    ----------
    frames : whether the page wants frames; programs that read exact values do not
    """

    def __init__(self, frames: bool = True) -> None:
        self.frames = frames
        self.asking = False  # whether the page waits for `answer`
        self._answer: str | bytes | None = None
        self._texts: dict[object, Told] = {}  # in the order of sending
        self._latest: Values | None = None
        self._sent: Values | None = None
        self._seq = 0
        self._acknowledged = 0
        self._something = asyncio.Event()

    def tell(self, message: Told) -> None:
        """Queue a message."""
        key = message["type"] if message["type"] in LATEST_ONLY else object()
        self._texts.pop(key, None)
        self._texts[key] = message
        self._something.set()

    def answer(self, data: str | bytes) -> None:
        """Queue the answer to the one request that waits until the light belongs to the state."""
        self._answer = data
        self._something.set()

    def offer(self, values: Values) -> None:
        """Make these the values to send next."""
        if not self.frames:
            return
        self._latest = values
        self._something.set()

    def start_over(self) -> None:
        """Values from now on are those of another mesh: the next frame holds all of them."""
        self._latest = self._sent = None

    def acknowledge(self, seq: int) -> None:
        """Record that the page shows frame `seq`, and so has received those before it."""
        if self._acknowledged < seq <= self._seq:
            self._acknowledged = seq
            self._something.set()

    @property
    def overflows(self) -> bool:
        """Whether the page sends requests without receiving the answers."""
        return len(self._texts) > MAX_WAITING

    def next_answer(self) -> str | bytes | None:
        """The answer to send now; afterwards the page may send another request."""
        data, self._answer = self._answer, None
        self.asking = self.asking and data is None
        return data

    def next_text(self) -> str | None:
        """The message to send now."""
        if not self._texts:
            return None
        return json.dumps(self._texts.pop(next(iter(self._texts))), allow_nan=False)

    def next_frame(self) -> bytes | None:
        """The binary frame to send now."""
        if self._latest is self._sent or self._seq - self._acknowledged >= IN_FLIGHT:
            return None
        assert self._latest is not None
        self._seq += 1
        frame = frame_bytes(self._seq, self._latest, self._sent)
        self._sent = self._latest
        return frame

    async def send_all(
        self, send_text: Callable[[str], Awaitable[None]], send_bytes: Callable[[bytes], Awaitable[None]]
    ) -> None:
        """Send everything that waits, texts first, until the connection ends."""
        while True:
            await self._something.wait()
            self._something.clear()
            while True:
                if (text := self.next_text()) is not None:
                    await send_text(text)
                elif (answer := self.next_answer()) is not None:
                    await (send_text(answer) if isinstance(answer, str) else send_bytes(answer))
                elif (frame := self.next_frame()) is not None:
                    await send_bytes(frame)
                else:
                    break
