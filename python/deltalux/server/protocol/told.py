# SPDX-License-Identifier: Apache-2.0
"""What the server tells pages and programs as JSON: the one declaration of each message.

A docstring says when a message comes, a note beside a type what the field holds; the page's types and the
tables of docs/reference/viewer-protocol.md are made of them by tools/make_protocol.py.
"""

from __future__ import annotations

from typing import Annotated, Literal, TypedDict

from .messages import Pose, Rgb

TaskName = Literal["bake", "check", "export", "read"]  # the last is soon done, and tells nothing
PhaseName = Literal["empty", "baking", "preview", "ready", "updating", "checking", "failed"]


class StateMessage(TypedDict):
    """On connecting, and after each accepted change, to every page."""

    type: Literal["state"]
    revision: int
    poses: Annotated[dict[str, Pose | None], "{name: 16 numbers, or null where removed}"]
    factors: Annotated[dict[str, float], "{group: factor}"]
    reflectances: Annotated[dict[str, Rgb], "{material: [r,g,b]}"]
    dark: Annotated[bool, ": no lamp shines, or there is none"]
    undo: Annotated[str | None, ": name of the step, or null"]
    redo: Annotated[str | None, ": likewise"]
    phase: PhaseName
    budget: Annotated[float | None, ": milliseconds, or null"]


class ProgressMessage(TypedDict):
    """During long work, at most 10 a second."""

    type: Literal["progress"]
    task: TaskName
    stage: str
    fraction: Annotated[float, "of the whole task"]
    eta: Annotated[float | None, "seconds or null"]


class FrameMessage(TypedDict):
    """After each bake and update."""

    type: Literal["frame"]
    revision: int
    milliseconds: Annotated[dict[str, float], "by stage"]
    affected_paths: int
    paths: int
    retraced_segments: int
    segments: int
    gathered_rays: Annotated[int, "that were cast"]
    changed_rays: Annotated[int, "of these, after updates: that met something else than before"]
    done: Annotated[float, "(1: all)"]
    static_method: str | None
    moving_method: Annotated[str | None, "(null: no such part, or it has no discs)"]
    recompute_milliseconds: Annotated[float | None, "or null"]
    speed_up: Annotated[float | None, "or null"]
    latency: Annotated[
        float | None, "ms from the newest edit's arrival to the frame, null where nothing was new"
    ]


class GeometryMessage(TypedDict):
    """Before the frames of another mesh; on connecting, where it is not 0."""

    type: Literal["geometry"]
    number: Annotated[int, "of the geometry that is to be fetched"]


class UnreachedMessage(TypedDict):
    """Once for light at rest, not during a drag."""

    type: Literal["unreached"]
    revision: int
    samples: Annotated[int, "that no path reached, which is 0 in most scenes"]


class CheckedMessage(TypedDict):
    """After `check`."""

    type: Literal["checked"]
    same: bool
    digest: str
    recomputed: str
    milliseconds: float


class ExportedMessage(TypedDict):
    """After `export`, to the page that asked."""

    type: Literal["exported"]
    id: float
    file: str
    bytes: int
    address: Annotated[str, "(relative, without the token)"]


class FinishedMessage(TypedDict):
    """After `finish`, to the one that asked."""

    type: Literal["finished"]
    id: float
    revision: Annotated[int, "of the light"]
    digest: Annotated[str | None, "or null"]
    frame: Annotated[FrameMessage | None, ": the last message of that type, or null"]


class CancelledMessage(TypedDict):
    """After `cancel`."""

    type: Literal["cancelled"]
    task: str


class NoticeMessage(TypedDict):
    """Whenever there is something that everybody should know: nothing can be moved, an update failed, the
    session refused an edit (which the next `state` takes back).
    """

    type: Literal["notice"]
    message: str


class AcceptedMessage(TypedDict):
    """After a request that was understood and has no answer of its own."""

    type: Literal["accepted"]
    id: float
    revision: Annotated[int, "that holds the edit"]


class ErrorMessage(TypedDict):
    """After a request that is refused, which changes nothing."""

    type: Literal["error"]
    id: Annotated[float | None, ": null where the message had none"]
    message: str


Answer = AcceptedMessage | ErrorMessage | ExportedMessage | FinishedMessage
News = (
    StateMessage
    | ProgressMessage
    | FrameMessage
    | GeometryMessage
    | UnreachedMessage
    | CheckedMessage
    | CancelledMessage
    | NoticeMessage
)
Told = News | Answer
