# SPDX-License-Identifier: Apache-2.0
"""What an experiment does with each of its seeds: one after another, or where `spread` says."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any, TypeVar

from .progress_parts import Steps

T = TypeVar("T")
Done = Callable[[], None]  # reports one finished step
OfSeed = Callable[[int, Done], Any]
# Calls a function with each of the seeds; also given: how much of the experiment one step is.
Spread = Callable[[OfSeed, Sequence[int], float], list[Any]]

_spread: ContextVar[Spread | None] = ContextVar("spread", default=None)


def by_seed(one: Callable[[int, Done], T], seeds: Sequence[int], steps: Steps) -> list[T]:
    """What `one` returns for each seed, in the order of the seeds.

    Parameters
    ----------
    one : (seed, done) -> anything that can be pickled; calls `done` after each step. It must not change what
        it shares with the calls of other seeds, which may run in other processes
    seeds : of the experiment
    steps : of the experiment
    """
    spread = _spread.get()
    if spread is None or len(seeds) < 2:
        return [one(seed, steps.done) for seed in seeds]
    return spread(one, seeds, steps.share)


@contextmanager
def spread_by(spread: Spread) -> Iterator[None]:
    """Within the block, `by_seed` hands seeds to `spread`."""
    token = _spread.set(spread)
    try:
        yield
    finally:
        _spread.reset(token)
