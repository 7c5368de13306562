# SPDX-License-Identifier: Apache-2.0
"""Messages from pages and programs: a closed set of types; every message is checked before it is used.

A docstring says what a request does, a note beside a type what the field holds; see `told`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, dataclass, fields
from typing import Annotated, Any, ClassVar

from deltalux.errors import OptionError
from deltalux.scene import rigid_pose
from deltalux.server.edits import pose_matrix

from .arrays import READABLE

Pose = tuple[float, ...]  # 4x4, rigid, column by column
Rgb = tuple[float, float, float]
MAX_TEXT = 1 << 20  # bytes: some thousands of moves
MAX_ID = 2**53
MAX_FACTOR = 1e6  # the core's own limit
MAX_BUDGET = 10_000.0  # milliseconds


@dataclass(frozen=True)
class Names:
    """Names that messages may refer to."""

    movables: Collection[str]
    groups: Collection[str]
    materials: Collection[str]
    fixed: Collection[str] = ()  # meshes that cannot be moved


@dataclass(frozen=True)
class Message:
    """Fields of every request: the id that its answer repeats."""

    type: ClassVar[str]
    accepted: ClassVar[bool] = True  # answered as soon as it is understood; otherwise when it is done
    id: int | float


@dataclass(frozen=True)
class Move(Message):
    """Put an object at a pose. While `dragging`, updates keep to the time budget, and all moves up to
    the one with `dragging: false` are one step of the history.
    """

    type = "move"
    name: str
    pose: Pose
    dragging: bool = False


@dataclass(frozen=True)
class Remove(Message):
    """Remove a movable."""

    type = "remove"
    name: str


@dataclass(frozen=True)
class Add(Message):
    """Put a removed movable back."""

    type = "add"
    name: str


@dataclass(frozen=True)
class Dim(Message):
    """Set the factor of a light group (1 = as loaded, 0 to 1e6)."""

    type = "dim"
    group: str
    factor: float
    dragging: bool = False


@dataclass(frozen=True)
class Dims(Message):
    """Set the factors of several light groups; one step of the history."""

    type = "dims"
    factors: Annotated[dict[str, float], "{group: factor}"]
    dragging: bool = False


@dataclass(frozen=True)
class Reflectance(Message):
    """Set the reflectance of a material, 0 to 1."""

    type = "reflectance"
    material: str
    value: Annotated[Rgb, "[r,g,b]"]
    dragging: bool = False


@dataclass(frozen=True)
class Edit(Message):
    """Make all of them in this order, or none; one step of the history."""

    type = "edit"
    edits: Annotated[
        tuple[Message, ...],
        ": a list of `move`, `remove`, `add`, `dim`, `reflectance`, each with `type` and without `id`",
    ]


@dataclass(frozen=True)
class Undo(Message):
    """Take the last step back, exactly."""

    type = "undo"


@dataclass(frozen=True)
class Redo(Message):
    """Repeat the step that was taken back last, exactly."""

    type = "redo"


@dataclass(frozen=True)
class Bake(Message):
    """Compute everything again with the present settings."""

    type = "bake"


@dataclass(frozen=True)
class MakeMovable(Message):
    """Bake again with a mesh movable that was not, keeping edits; a page then gets another `geometry`."""

    type = "make_movable"
    mesh: str


@dataclass(frozen=True)
class AddLamp(Message):
    """Bake again with one more point light, keeping edits; it is a light group of its own, and one step of
    the history, which `undo` switches off.
    """

    type = "add_lamp"
    position: Annotated[tuple[float, float, float], "[x,y,z], metres"]


@dataclass(frozen=True)
class Check(Message):
    """Recompute everything and compare the digests."""

    type = "check"


@dataclass(frozen=True)
class Cancel(Message):
    """Stop the running bake or check; the light stays as it was."""

    type = "cancel"


@dataclass(frozen=True)
class Budget(Message):
    """Set the time budget of one update during a drag; null = no limit."""

    type = "budget"
    milliseconds: Annotated[float | None, "(1 to 10,000) or null"]


@dataclass(frozen=True)
class Export(Message):
    """Write NAME.glb, .csv, .npz, .png or .dlx into the server's folder."""

    type = "export"
    accepted = False
    file: str


@dataclass(frozen=True)
class Finish(Message):
    """Wait until the light is that of the state: `finished`."""

    type = "finish"
    accepted = False
    digest: Annotated[bool, ": true or false"] = False


@dataclass(frozen=True)
class Read(Message):
    """Wait likewise, and read exact values: a binary message."""

    type = "read"
    accepted = False
    arrays: Annotated[tuple[str, ...], ": some of `irradiance`, `standard_error`, `points`, `normals`"]


@dataclass(frozen=True)
class Ack:
    """The frame of that number, and with it all before, is on the screen; no `id`, no answer."""

    type: ClassVar[str] = "ack"
    seq: int


EDITS: tuple[type[Message], ...] = (Move, Remove, Add, Dim, Reflectance)
_OTHERS: tuple[type[Message], ...] = (
    Dims, Edit, Undo, Redo, Bake, MakeMovable, AddLamp, Check, Cancel, Budget, Export, Finish, Read,
)  # fmt: skip
REQUESTS = {kind.type: kind for kind in (*EDITS, *_OTHERS)}


class BadMessage(OptionError):
    """A message that cannot be used; `id` is the request's, if it has a valid one."""

    def __init__(self, text: str, id_: int | float | None = None) -> None:
        super().__init__(text)
        self.id = id_


def parse(text: str, names: Names) -> Message | Ack:
    """Read one message.

    Raises
    ------
    BadMessage
        If it is no JSON object, of unknown type, or has a missing, unknown or wrong field.
    """
    data = _json_object(text)
    kind = data.pop("type", None)
    if kind == Ack.type:
        return _read_fields(Ack, data, names)
    number = data.get("id")
    if not isinstance(kind, str) or kind not in REQUESTS:
        known = ", ".join([*REQUESTS, Ack.type])
        raise BadMessage(f"message: type: found {_shown(kind)}, expected one of {known}", _id_or_none(number))
    try:
        return _read_fields(REQUESTS[kind], data, names)
    except OptionError as error:
        raise BadMessage(str(error), _id_or_none(number)) from None


def _json_object(text: str) -> dict[str, Any]:
    def refuse(constant: str) -> None:
        raise ValueError(f"found {constant}")

    try:
        data = json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise BadMessage(f"message: expected JSON ({error})") from None
    if not isinstance(data, dict):
        raise BadMessage(f"message: found {_shown(data)}, expected an object with a type")
    return data


def _id_or_none(value: Any) -> int | float | None:
    return value if _is_number(value) and abs(value) <= MAX_ID else None


def _read_fields(kind: type, data: Mapping[str, Any], names: Names) -> Any:
    expected = {field.name: field.default is MISSING for field in fields(kind)}
    missing = [name for name, required in expected.items() if required and name not in data]
    unknown = [name for name in data if name not in expected]
    if missing or unknown:
        wrong = f"no {missing[0]}" if missing else f"the field {_shown(unknown[0])}"
        raise BadMessage(f"{kind.type}: found {wrong}, expected {', '.join(expected)}")  # type: ignore[attr-defined]
    return kind(**{name: _READERS[name](value, names) for name, value in data.items()})


# ---- fields ----------------------------------------------------------------------------------------


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # an integer beyond any float
        return False


def _shown(value: Any) -> str:
    """A value, shortened for an error message."""
    text = json.dumps(value, default=str)
    return text if len(text) <= 60 else text[:57] + "…"


def _number(value: Any, low: float, high: float, what: str) -> Any:
    if not _is_number(value) or not low <= value <= high:
        raise BadMessage(f"{what}: found {_shown(value)}, expected a number from {low:g} to {high:g}")
    return value


def _numbers(value: Any, count: int, low: float, high: float, what: str) -> tuple[float, ...]:
    if not isinstance(value, list) or len(value) != count:
        raise BadMessage(f"{what}: found {_shown(value)}, expected {count} numbers")
    return tuple(float(_number(v, low, high, what)) for v in value)


def _one_of(value: Any, known: Collection[str], what: str) -> str:
    if not isinstance(value, str) or value not in known:
        raise BadMessage(f"{what}: found {_shown(value)}, expected one of {_shown(sorted(known))}")
    return value


def _factor(value: Any) -> float:
    return float(_number(value, 0, MAX_FACTOR, "factor"))


def _factors(value: Any, names: Names) -> dict[str, float]:
    if not isinstance(value, dict) or not value:
        raise BadMessage(f"factors: found {_shown(value)}, expected an object of factors by light group")
    return {_one_of(group, names.groups, "group"): _factor(factor) for group, factor in value.items()}


def _pose(value: Any, _: Names) -> tuple[float, ...]:
    numbers = _numbers(value, 16, -1e15, 1e15, "pose")
    rigid_pose(pose_matrix(numbers))
    return numbers


def _flag(what: str) -> Callable[[Any, Names], bool]:
    def read(value: Any, _: Names) -> bool:
        if not isinstance(value, bool):
            raise BadMessage(f"{what}: found {_shown(value)}, expected true or false")
        return value

    return read


def _edits(value: Any, names: Names) -> tuple[Message, ...]:
    if not isinstance(value, list):
        raise BadMessage(f"edits: found {_shown(value)}, expected a list of edits")
    return tuple(read_edit(each, names) for each in value)


def read_edit(data: Any, names: Names) -> Message:
    """One of the edits of `Edit`: a message without `id`.

    Raises
    ------
    OptionError
    """
    kind = data.get("type") if isinstance(data, dict) else None
    known = {edit.type: edit for edit in EDITS}
    if not isinstance(kind, str) or kind not in known:
        raise BadMessage(f"edits: found {_shown(data)}, expected a message of type {', '.join(known)}")
    if "id" in data:
        raise BadMessage(f"edits: found an id in {_shown(data)}, expected it in the message around")
    fields_ = {name: field for name, field in data.items() if name != "type"}
    return _read_fields(known[kind], fields_ | {"id": 0}, names)


def _arrays(value: Any, _: Names) -> tuple[str, ...]:
    if not isinstance(value, list) or not value or len(value) > len(READABLE):
        raise BadMessage(f"arrays: found {_shown(value)}, expected a list of {', '.join(READABLE)}")
    return tuple(_one_of(name, READABLE, "arrays") for name in value)


def _file(value: Any, _: Names) -> str:
    if not isinstance(value, str):
        raise BadMessage(f"file: found {_shown(value)}, expected a name")
    return value


def _milliseconds(value: Any, _: Names) -> float | None:
    return None if value is None else float(_number(value, 1, MAX_BUDGET, "milliseconds"))


def _sequence_number(value: Any, _: Names) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < 2**32:
        raise BadMessage(f"seq: found {_shown(value)}, expected the number of a frame")
    return value


# By field name: a name has the same meaning in every message.
_READERS: dict[str, Callable[[Any, Names], Any]] = {
    "id": lambda value, names: _number(value, -MAX_ID, MAX_ID, "id"),
    "name": lambda value, names: _one_of(value, names.movables, "name"),
    "group": lambda value, names: _one_of(value, names.groups, "group"),
    "material": lambda value, names: _one_of(value, names.materials, "material"),
    "factor": lambda value, names: _factor(value),
    "factors": _factors,
    "value": lambda value, names: _numbers(value, 3, 0, 1, "value"),
    "pose": _pose,
    "mesh": lambda value, names: _one_of(value, names.fixed, "mesh"),
    "position": lambda value, names: _numbers(value, 3, -1e15, 1e15, "position"),
    "dragging": _flag("dragging"),
    "digest": _flag("digest"),
    "edits": _edits,
    "arrays": _arrays,
    "file": _file,
    "milliseconds": _milliseconds,
    "seq": _sequence_number,
}
