# SPDX-License-Identifier: Apache-2.0
"""Undo and redo: steps as pairs of before and after, so that a way back is exact."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

from deltalux.errors import OptionError

from .edits import EditState, Key, Value

MAX_STEPS = 1000
_VERBS = {"pose": "move", "factor": "dim", "reflectance": "paint"}


@dataclass
class _Step:
    key: Key
    before: Value
    after: Value
    dragged_by: Hashable | None = None  # the page whose drag goes on

    @property
    def name(self) -> str:
        kind, what = self.key
        verb = ("add" if self.after else "remove") if kind == "present" else _VERBS[kind]
        return f"{verb} {what}"


class History:
    """The wanted state and the steps that led to it.

    Parameters
    ----------
    state : EditState
        The state that the first step starts from.
    """

    def __init__(self, state: EditState) -> None:
        self.state = dict(state)
        self._done: list[_Step] = []
        self._undone: list[_Step] = []

    @property
    def undo_name(self) -> str | None:
        """What `undo` would take back."""
        return self._done[-1].name if self._done else None

    @property
    def redo_name(self) -> str | None:
        """What `redo` would do again."""
        return self._undone[-1].name if self._undone else None

    @property
    def dragging(self) -> bool:
        """Whether some page is in the middle of a drag."""
        return any(step.dragged_by is not None for step in self._done)

    def edit(self, key: Key, value: Value, page: Hashable, dragging: bool = False) -> None:
        """Give `key` its `value`; what one page drags is one step until it lets go."""
        before, self.state[key] = self.state[key], value
        step = self._open_step(key, page)
        if step is None:
            step = _Step(key, before, value)
            self._done.append(step)
        step.after = value
        step.dragged_by = page if dragging else None
        if not dragging and step.before == step.after:
            self._done.remove(step)  # nothing has happened
        elif before != value:
            self._undone.clear()
        del self._done[:-MAX_STEPS]

    def release(self, page: Hashable) -> None:
        """End the drags of a page that is gone."""
        for step in [step for step in self._done if step.dragged_by == page]:
            self.edit(step.key, self.state[step.key], page)

    def undo(self) -> None:
        """Take the last step back, exactly; OptionError where there is none."""
        if not self._done:
            raise OptionError("undo: found no step to take back")
        step = self._done.pop()
        self.state[step.key] = step.before
        step.dragged_by = None
        self._undone.append(step)

    def redo(self) -> None:
        """Do the step again that was taken back last; OptionError where there is none."""
        if not self._undone:
            raise OptionError("redo: found no step that was taken back")
        step = self._undone.pop()
        self.state[step.key] = step.after
        self._done.append(step)

    def _open_step(self, key: Key, page: Hashable) -> _Step | None:
        """The step that this page's drag of `key` goes on with: the last one of that key, if it is open.

        Later steps of other keys do not matter: the order in which different keys go back is of no
        consequence.
        """
        for step in reversed(self._done):
            if step.key == key:
                return step if step.dragged_by == page else None
        return None
