# SPDX-License-Identifier: Apache-2.0
"""Undo and redo: steps as pairs of values before and after, so that undo is exact."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Set
from dataclasses import dataclass

from deltalux.errors import OptionError

from .edits import EditState, Key, Value

MAX_STEPS = 1000
_VERBS = {"pose": "move", "factor": "dim", "reflectance": "paint"}


@dataclass
class _Step:
    before: dict[Key, Value]
    after: dict[Key, Value]
    dragged_by: Hashable | None = None  # the page whose drag continues this step
    verb: str | None = None  # None: by what is set

    @property
    def name(self) -> str:
        ((kind, what), value), *more = self.after.items()
        verb = self.verb or (("add" if value else "remove") if kind == "present" else _VERBS[kind])
        return f"{verb} {what} and {len(more)} more" if more else f"{verb} {what}"


class History:
    """The wanted state and the steps that led to it.

    Parameters
    ----------
    state : EditState
        State before the first step.
    """

    def __init__(self, state: EditState) -> None:
        self.state = dict(state)
        self._done: list[_Step] = []
        self._undone: list[_Step] = []

    @property
    def undo_name(self) -> str | None:
        """Name of the step that `undo` would take back."""
        return self._done[-1].name if self._done else None

    @property
    def redo_name(self) -> str | None:
        """Name of the step that `redo` would repeat."""
        return self._undone[-1].name if self._undone else None

    @property
    def dragging(self) -> bool:
        """Whether a page is dragging something."""
        return any(step.dragged_by is not None for step in self._done)

    def edit(self, key: Key, value: Value, page: Hashable, dragging: bool = False) -> None:
        """Set `key` to `value`; a page's whole drag is one step."""
        self.edit_together({key: value}, page, dragging)

    def edit_together(self, values: Mapping[Key, Value], page: Hashable, dragging: bool = False) -> None:
        """Set several keys in one step; a drag of the same keys continues its step."""
        before = {key: self.state[key] for key in values}
        self.state.update(values)
        step = self._drag_of(values.keys(), page)
        if step is None:
            step = _Step(before, {})
            self._done.append(step)
        step.after = dict(values)
        step.dragged_by = page
        if not dragging:
            self._let_go(step)
        if before != values:
            self._undone.clear()
        del self._done[:-MAX_STEPS]

    def extend(self, state: EditState) -> None:
        """Take over the keys of `state` that are new."""
        self.state = {**state, **self.state}

    def add_lamp(self, group: str) -> None:
        """Record as a step that a lamp, a light group of its own, was added: undone, it is off."""
        key: Key = ("factor", group)
        self._done.append(_Step({key: 0.0}, {key: self.state[key]}, verb="add"))
        self._undone.clear()

    def release(self, page: Hashable) -> None:
        """End the drags of a page that has disconnected."""
        for step in [step for step in self._done if step.dragged_by == page]:
            self._let_go(step)

    def undo(self) -> None:
        """Take the last step back, exactly; OptionError if there is none."""
        if not self._done:
            raise OptionError("undo: found no step to take back")
        step = self._done.pop()
        self.state.update(step.before)
        step.dragged_by = None
        self._undone.append(step)

    def redo(self) -> None:
        """Repeat the step that was taken back last; OptionError if there is none."""
        if not self._undone:
            raise OptionError("redo: found no step that was taken back")
        step = self._undone.pop()
        self.state.update(step.after)
        self._done.append(step)

    def _let_go(self, step: _Step) -> None:
        """End a step's drag, and drop the step if it changed nothing."""
        step.dragged_by = None
        if step.before == step.after:
            self._done = [kept for kept in self._done if kept is not step]

    def _drag_of(self, keys: Set[Key], page: Hashable) -> _Step | None:
        """The step of `page`'s drag of exactly these keys; other drags of any of these keys end.

        Therefore, of the steps that share a key, only the last one can still change. Steps of different keys
        can be undone in any order.
        """
        found = None
        for step in [s for s in self._done if s.dragged_by is not None and s.after.keys() & keys]:
            if step.dragged_by == page and step.after.keys() == keys:
                found = step
            else:
                self._let_go(step)
        return found
