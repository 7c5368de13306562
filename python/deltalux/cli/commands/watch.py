# SPDX-License-Identifier: Apache-2.0
"""`update --watch`: keeps a session open, and updates it whenever a file of edits changes."""

from __future__ import annotations

import os
import stat
import time
from collections.abc import Callable, Sequence
from hashlib import sha256
from pathlib import Path
from typing import Any

import deltalux as dl
from deltalux.cli.baking import figures, total_milliseconds
from deltalux.cli.console import Terminal, print_error
from deltalux.cli.edits import edits_of_json, queue_edits
from deltalux.cli.failures import EXPECTED, failure_text
from deltalux.cli.jobs import after_opening, counts_of_session, in_pixels
from deltalux.cli.shots import Shot
from deltalux.cli.targets import write_refined
from deltalux.errors import Cancelled, Error, FormatError, OptionError
from deltalux.server.edits import Key, Value, differences, queue_edit, state_of

POLL = 0.2  # seconds between two checks of the file
# seconds for which the file must not change before it is read: editors write in pieces
REST = 0.1
ABSENT = 1.0  # seconds for which it may be absent: editors also remove and rename
COARSEST = 2.5  # seconds; coarsest resolution of a file system's modification times
LARGEST = 1 << 24  # bytes


class WatchedFile:
    """A file whose successive contents are read.

    It is polled, which works on every file system and for every way of writing.

    Parameters
    ----------
    path : file that need not exist yet
    wait : function that sleeps for some seconds
    """

    def __init__(self, path: Path, wait: Callable[[float], object] = time.sleep) -> None:
        self._path, self._wait = path, wait
        self._read: object = object()  # the file's status when it was read
        self._digest = b""

    def forget(self) -> None:
        """Return the present content again once the file is rewritten."""
        self._digest = b""

    def next(self) -> bytes:
        """Wait for content that differs from that of the last call, then return it.

        Raises
        ------
        OSError, FormatError
            Once if the file is absent, or cannot be read.
        """
        while True:
            look = self._look()
            if look != self._read or self._recent(look):
                self._wait(REST if look else ABSENT)
                if self._look() == look:
                    self._read = look
                    if (content := self._new_content()) is not None:
                        return content
            self._wait(POLL)

    def _look(self) -> tuple[int, ...] | None:
        try:
            found = self._path.stat()
        except OSError:
            return None
        return found.st_mode, found.st_dev, found.st_ino, found.st_size, found.st_mtime_ns, found.st_ctime_ns

    def _recent(self, look: tuple[int, ...] | None) -> bool:
        """Whether the file may have changed since with an unchanged status."""
        return look is not None and abs(time.time() - 1e-9 * look[4]) < COARSEST

    def _new_content(self) -> bytes | None:
        try:
            content = _content(self._path)
        except (OSError, FormatError):
            self.forget()
            raise
        digest = sha256(content).digest()
        if digest == self._digest:
            return None
        self._digest = digest
        return content


def _content(path: Path) -> bytes:
    with open(path, "rb", opener=_without_waiting) as file:
        if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):  # a pipe or device might never end
            raise FormatError(f"{path}: found a device or pipe, expected a file of edits")
        content = file.read(LARGEST + 1)
    if len(content) > LARGEST:
        raise FormatError(f"{path}: found more than {LARGEST >> 20} MiB, expected edits as JSON")
    return content


def _without_waiting(name: str, flags: int) -> int:
    """Open without blocking, even a pipe that nobody writes to."""
    return os.open(name, flags | os.O_NONBLOCK)


class Watch:
    """A session that is updated after each change of a file of edits.

    Parameters
    ----------
    session : baked; the edits of the file are relative to its present state
    name, path : name of the session's file, path of the file of edits
    targets, words, shot : see `write_refined`
    terminal : receives one line for each change
    """

    def __init__(
        self,
        session: dl.Session,
        name: str,
        path: Path,
        targets: Sequence[Path],
        words: Sequence[str],
        shot: Shot,
        terminal: Terminal,
    ) -> None:
        self._session, self._name, self._path = session, name, path
        self._targets, self._words, self._shot = targets, words, shot
        self._terminal = terminal
        self._base = state_of(session)
        self._stale = True  # the results do not show the session's state
        self._at_work = False

    def follow(self, file: WatchedFile) -> None:
        """Follow the file until Ctrl-C; KeyboardInterrupt if that stops an update."""
        try:
            while True:
                self._follow_one(file)
        except KeyboardInterrupt:
            if self._at_work:
                raise

    def _follow_one(self, file: WatchedFile) -> None:
        try:
            data, line = self._update(file.next())
        except Cancelled:
            raise
        except EXPECTED as error:
            self._at_work = False
            file.forget()
            problem = failure_text(error)
            print_error(f"{problem}; watching on")
            self._terminal.record({"watch": str(self._path), "problem": problem})
        else:
            self._terminal.record(data, f"{time.strftime('%H:%M:%S')} {self._path}: {line}")

    def _update(self, content: bytes) -> tuple[dict[str, Any], str]:
        before = state_of(self._session)
        self._queue(content, before)
        data: dict[str, Any] = {}
        targets = self._targets if self._stale or state_of(self._session) != before else []
        self._stale = self._at_work = True
        counts = in_pixels(counts_of_session(self._session), self._shot.size)
        with self._terminal.overall(after_opening(counts, targets)) as progress:
            self._session.progress = progress
            frame = self._session.update()
            write_refined(self._session, targets, self._words, self._shot, progress)
            if self._terminal.as_json:  # JSON contains figures that take longer than an update
                progress.begin("sum up")
                data = figures(self._session, frame)
        self._stale = self._at_work = False
        data |= {
            "session": self._name,
            "watch": str(self._path),
            "affected_paths": frame.affected_paths,
            "retraced_segments": frame.retraced_segments,
            "outputs": [str(path) for path in targets],
        }
        written = f"; wrote {', '.join(data['outputs'])}" if targets else ""
        line = f"{frame.affected_paths:,} paths traced again in {total_milliseconds(frame):,.1f} ms{written}"
        return data, line

    def _queue(self, content: bytes, before: dict[Key, Value]) -> None:
        """Queue the edits from the state `before` to the file's state; nothing if an edit is refused."""
        try:
            edits = edits_of_json(content)
            self._queue_state(self._base)
            queue_edits(self._session, edits)
        except Error as error:
            self._queue_state(before)
            raise OptionError(f"{self._path}: {error}") from None

    def _queue_state(self, state: dict[Key, Value]) -> None:
        for key, value in differences(self._session, state).items():
            queue_edit(self._session, key, value)
