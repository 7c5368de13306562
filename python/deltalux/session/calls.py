# SPDX-License-Identifier: Apache-2.0
"""One call at a time: keeps threads, progress callbacks and forked processes apart."""

from __future__ import annotations

import functools
import os
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Concatenate, ParamSpec, Protocol, TypeVar

from deltalux.errors import OptionError


class Calls:
    """Admits one call at a time to a session.

    While a long call (a bake, an update) runs, other calls are refused. Short calls (queueing an edit) take
    microseconds, and other calls wait for them. No call may be made from inside another one, for example
    from its progress callback.
    """

    def __init__(self) -> None:
        self._changed = threading.Condition()
        self._call: object | None = None  # the call that is running
        self._thread = 0
        self._long = False
        self._process = os.getpid()

    def locked(self) -> bool:
        """Whether a call is running."""
        return self._call is not None

    @contextmanager
    def one(self, long: bool) -> Iterator[None]:
        """Run the block as the only call.

        Raises
        ------
        OptionError
            While a long call runs, from inside a call, and in another process.
        """
        self.check_process()
        own = object()
        try:
            with self._changed:
                while self._call is not None:
                    if self._long or self._thread == threading.get_ident():
                        raise OptionError(
                            "session: another call is at work, of another thread or of this progress "
                            "callback; wait until it returns"
                        )
                    self._changed.wait()
                self._long, self._thread = long, threading.get_ident()
                self._call = own
            yield
        finally:
            if self._call is own:
                self._call = None
                with self._changed:
                    self._changed.notify_all()

    def check_process(self) -> None:
        """Raise OptionError in a forked process, which does not have the worker threads."""
        if os.getpid() != self._process:
            raise OptionError(
                f"session: it was made in process {self._process}, this one was forked from it; save the "
                "session there, and open the file here"
            )


class HasCalls(Protocol):
    """Anything that has a `Calls`."""

    _calls: Calls


_S = TypeVar("_S", bound=HasCalls)
_P = ParamSpec("_P")
_R = TypeVar("_R")


def _guarded(long: bool) -> Callable[[Callable[Concatenate[_S, _P], _R]], Callable[Concatenate[_S, _P], _R]]:
    def guard(method: Callable[Concatenate[_S, _P], _R]) -> Callable[Concatenate[_S, _P], _R]:
        @functools.wraps(method)
        def guarded(self: _S, /, *args: _P.args, **kwargs: _P.kwargs) -> _R:
            with self._calls.one(long):
                return method(self, *args, **kwargs)

        return guarded

    return guard


short_call = _guarded(long=False)
long_call = _guarded(long=True)
