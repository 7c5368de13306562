# SPDX-License-Identifier: Apache-2.0
"""Connects pages and engine: messages become edits of one wanted state, events go to all pages."""

from __future__ import annotations

import asyncio
import json
import time
from typing import Any

from deltalux.errors import Error, OptionError
from deltalux.session import Session

from .drawn.geometry import Geometry
from .drawn.values import Values
from .edits import EditState, Key, Kind, Value, pose_matrix
from .engine import Engine, remaking
from .engine.events import Event, Phase, Refined, Refused, Remade, Wanted
from .engine.known import known_of
from .exports import Exports
from .history import History
from .page import Page
from .protocol.arrays import arrays_bytes, arrays_of
from .protocol.messages import (
    EDITS,
    Ack,
    Add,
    AddLamp,
    BadMessage,
    Bake,
    Budget,
    Cancel,
    Check,
    Dim,
    Dims,
    Edit,
    Export,
    Finish,
    MakeMovable,
    Message,
    Move,
    Read,
    Redo,
    Reflectance,
    Remove,
    Undo,
    parse,
)
from .protocol.told import Answer, ErrorMessage, FinishedMessage, FrameMessage, News, PhaseName, StateMessage

MAX_PAGES = 32


class Hub:
    """The state that all pages share. Its methods must be called on the server's event loop.

    Parameters
    ----------
    session : Session, handed to the engine by `open`
    exports : where exported files are written
    geometry : what pages draw; None: there are no pages
    shown : encode values even while no page is connected, so that the first page has them at once
    """

    def __init__(
        self, session: Session, exports: Exports, geometry: Geometry | None, shown: bool = True
    ) -> None:
        self._exports, self._shown = exports, shown
        self.geometry = geometry
        self._known = known_of(session)
        self._history = History(self._known.state)
        self._phase: PhaseName = "updating" if session.baked else "empty"  # until the engine tells
        self._pages: set[Page] = set()
        self._values: Values | None = None
        # messages for pages that connect later, by type or subject
        self._kept: dict[str, News] = {}
        self._engine = Engine(session, self._from_engine, shown, geometry)
        self._revision = self._engine.first_revision
        self._loop: asyncio.AbstractEventLoop | None = None
        if not self._known.names.movables:
            self._keep_notice(
                "movables",
                "nothing in this scene can be moved yet; click something and choose Make movable, or name it "
                "with --movable NAME (dl.load(…, movable=[…])), or call its node MOVE_… in the file",
            )
        if session.foreign_build is not None:
            self._keep_notice(
                "build",
                f"the light of this session was computed by another build ({session.foreign_build}), whose "
                "bits may differ; everything is computed again before the first edit",
            )

    def open(self) -> None:
        """Start the engine; its events are delivered on the running loop."""
        self._loop = asyncio.get_running_loop()
        self._engine.start()

    def close(self) -> None:
        """Stop the engine; blocks until it has stopped."""
        self._engine.stop()

    # ---- pages --------------------------------------------------------------------------------

    def connect(self, frames: bool = True) -> Page:
        """Add a page and send it the present state; without `frames` it gets no values.

        Raises
        ------
        OptionError
            If too many pages are connected.
        """
        if len(self._pages) >= MAX_PAGES:
            raise OptionError(f"view: found {MAX_PAGES} pages connected, expected fewer; close one")
        page = Page(frames)
        self._pages.add(page)
        self._show()
        page.tell(self._state())
        for message in self._kept.values():
            page.tell(message)
        if self._values is not None:
            page.offer(self._values)
        return page

    @property
    def lit(self) -> bool:
        """Whether there are values, or will be in a moment."""
        return self._values is not None or self._phase in ("updating", "ready")

    def disconnect(self, page: Page) -> None:
        """Remove a page; objects that it was dragging stay where they are."""
        self._pages.discard(page)
        self._show()
        if self._history.dragging:
            self._history.release(page)
            self._state_changed()

    def _show(self) -> None:
        self._engine.show(self._shown or any(page.frames for page in self._pages))

    def receive(self, page: Page, text: str) -> None:
        """Process a page's message and answer it."""
        arrival = time.perf_counter()
        try:
            message = parse(text, self._known.names)
        except BadMessage as error:
            page.tell({"type": "error", "id": error.id, "message": str(error)})
            return
        if isinstance(message, Ack):
            page.acknowledge(message.seq)
            return
        try:
            changed = self._act(page, message)
        except Error as error:
            page.tell({"type": "error", "id": message.id, "message": str(error)})
            return
        if changed:
            self._state_changed(arrival)
        if message.accepted:
            page.tell({"type": "accepted", "id": message.id, "revision": self._revision})

    # ---- requests -----------------------------------------------------------------------------

    def _act(self, page: Page, message: Message) -> bool:
        """Execute a page's request; return whether the wanted state changed."""
        if isinstance(message, Edit):
            self._edit(page, message)
        elif isinstance(message, EDITS):
            key, value = self._checked(message, self._history.state)
            self._history.edit(key, value, page, getattr(message, "dragging", False))
        elif isinstance(message, Dims):
            factors: dict[Key, Value] = {("factor", group): f for group, f in message.factors.items()}
            self._history.edit_together(factors, page, message.dragging)
        elif isinstance(message, Undo):
            self._history.undo()
        elif isinstance(message, Redo):
            self._history.redo()
        else:
            self._control(page, message)
            return False
        return True

    def _edit(self, page: Page, message: Edit) -> None:
        """Make all edits of `message` in one step, or none; each is checked after the ones before it."""
        state = dict(self._history.state)
        changes: dict[Key, Value] = {}
        for edit in message.edits:
            key, value = self._checked(edit, state)
            state[key] = changes[key] = value
        self._history.edit_together(changes, page)

    def _checked(self, message: Message, state: EditState) -> tuple[Key, Value]:
        """Key and value that an edit sets in `state`; OptionError if the edit is impossible."""
        if isinstance(message, Move):
            _check_present(state, message.name, True, "move")
            self._known.reach.check(message.name, pose_matrix(message.pose))
            return ("pose", message.name), message.pose
        if isinstance(message, (Remove, Add)):
            present = isinstance(message, Add)
            _check_present(state, message.name, not present, message.type)
            return ("present", message.name), present
        if isinstance(message, Dim):
            return ("factor", message.group), message.factor
        assert isinstance(message, Reflectance)
        return ("reflectance", message.material), message.value

    def _control(self, page: Page, message: Message) -> None:
        """Set the engine's budget, give it a task, or stop its present task."""
        if isinstance(message, Budget):
            self._engine.set_budget(message.milliseconds)
            self._broadcast(self._state())
        elif isinstance(message, Bake):
            self._engine.bake()
        elif isinstance(message, MakeMovable):
            self._engine.remake(remaking.movable(self._known.scene, message.mesh))
        elif isinstance(message, AddLamp):
            self._engine.remake(remaking.lamp(self._known.scene, self._known.box, message.position))
        elif isinstance(message, Check):
            self._engine.check()
        elif isinstance(message, Cancel):
            self._engine.cancel()
        elif isinstance(message, Export):
            self._export(page, message)
        elif isinstance(message, (Finish, Read)):
            self._answer_at_rest(page, message)

    def _answer_at_rest(self, page: Page, message: Finish | Read) -> None:
        """Answer once the light belongs to the present state."""
        if page.asking:
            raise OptionError(f"{message.type}: found one that is not answered yet; wait for its answer")
        page.asking = True

        def answer(session: Session, revision: int, figure: FrameMessage | None) -> None:
            if isinstance(message, Read):
                header = {"type": "values", "id": message.id, "revision": revision}
                self._in_loop(page.answer, arrays_bytes(header, arrays_of(session, message.arrays)))
                return
            finished: FinishedMessage = {
                "type": "finished",
                "id": message.id,
                "revision": revision,
                "digest": session.digest() if message.digest else None,
                "frame": figure,
            }
            self._in_loop(page.answer, json.dumps(finished, allow_nan=False))

        def fail(reason: str) -> None:
            error: ErrorMessage = {"type": "error", "id": message.id, "message": reason}
            self._in_loop(page.answer, json.dumps(error))

        self._engine.at_rest(answer, fail)

    def _export(self, page: Page, message: Export) -> None:
        name = self._exports.checked_name(message.file)

        def write(session: Session) -> None:
            answer: Answer
            try:
                size, address = self._exports.write(name, session)
                answer = {
                    "type": "exported",
                    "id": message.id,
                    "file": name,
                    "bytes": size,
                    "address": address,
                }
            except (Error, OSError, MemoryError) as error:
                text = f'export "{name}": {error}'
                answer = {"type": "error", "id": message.id, "message": text}
            self._in_loop(page.tell, answer)

        self._engine.export(write)

    # ---- what pages see -----------------------------------------------------------------------

    def _state(self) -> StateMessage:
        state = self._history.state

        def of(kind: Kind) -> dict[str, Any]:
            return {name: value for (k, name), value in state.items() if k == kind}

        return {
            "type": "state",
            "revision": self._revision,
            "poses": {n: p if state["present", n] else None for n, p in of("pose").items()},
            "factors": of("factor"),
            "reflectances": of("reflectance"),
            "dark": self._known.is_dark(state),
            "undo": self._history.undo_name,
            "redo": self._history.redo_name,
            "phase": self._phase,
            "budget": self._engine.budget,
        }

    def _state_changed(self, arrival: float = 0.0) -> None:
        """Hand the wanted state to the engine and send it to every page."""
        self._revision += 1
        wanted = Wanted(dict(self._history.state), self._revision, self._history.dragging, arrival)
        self._engine.want(wanted)
        self._broadcast(self._state())

    def _broadcast(self, message: News) -> None:
        for page in self._pages:
            page.tell(message)

    def _keep_notice(self, subject: str, text: str) -> None:
        self._kept[subject] = {"type": "notice", "message": text}

    # ---- events of the engine -----------------------------------------------------------------

    def _in_loop(self, call: Any, *values: Any) -> None:
        """Call `call` on the server's event loop, unless the loop has ended."""
        assert self._loop is not None
        if not self._loop.is_closed():
            self._loop.call_soon_threadsafe(call, *values)

    def _from_engine(self, event: Event) -> None:
        self._in_loop(self._pass_on, event)

    def _pass_on(self, event: Event) -> None:
        if isinstance(event, Values):
            self._values = event
            for page in self._pages:
                page.offer(event)
        elif isinstance(event, Phase):
            self._phase = event.name
            self._kept.pop("progress", None)
            self._broadcast(self._state())
        elif isinstance(event, Refined):
            self._take_geometry(event.geometry)
        elif isinstance(event, Remade):
            self._take_version(event)
        elif isinstance(event, Refused):
            self._history.state[event.key] = event.value
            self._broadcast({"type": "notice", "message": event.message})
            self._state_changed()
        else:
            if event["type"] in ("frame", "progress", "unreached"):
                self._kept[event["type"]] = event
            self._broadcast(event)

    def _take_version(self, event: Remade) -> None:
        """The session is now one of another version of the scene, with all edits that were made before."""
        self._known = event.known
        if self._known.names.movables:
            self._kept.pop("movables", None)
        self._values = None
        for page in self._pages:
            page.start_over()
        if event.geometry is not None:
            self._take_geometry(event.geometry)
        self._history.extend(self._known.state)
        if event.remake.group is not None:
            self._history.add_lamp(event.remake.group)
        self._broadcast({"type": "notice", "message": event.remake.done})
        self._state_changed()

    def _take_geometry(self, geometry: Geometry) -> None:
        """Values of the mesh before are of no use any more; those of the new one come next."""
        self.geometry, self._values = geometry, None
        self._kept["geometry"] = {"type": "geometry", "number": geometry.number}
        for page in self._pages:
            page.start_over()
            page.tell(self._kept["geometry"])


def _check_present(state: EditState, name: str, expected: bool, verb: str) -> None:
    if state["present", name] != expected:
        found = "taken away; add it first" if expected else "in the scene already"
        raise OptionError(f'{verb} "{name}": it is {found}')
