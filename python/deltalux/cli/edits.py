# SPDX-License-Identifier: Apache-2.0
"""Edits of a session, from options or from an equivalent JSON file."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import typer

import deltalux as dl
from deltalux.errors import OptionError
from deltalux.scene.naming import meant_by

from .options import Move, Setting, parse_dim, parse_move, parse_reflectance


@dataclass(frozen=True)
class Edits:
    """Edits to apply."""

    add: Sequence[str] = ()
    move: Sequence[Move] = ()
    remove: Sequence[str] = ()
    dim: Sequence[Setting] = ()
    reflectance: Sequence[Setting] = ()


KINDS = tuple(Edits.__dataclass_fields__)


def queue_edits(session: dl.Session, edits: Edits) -> None:
    """Queue all of `edits`, moves relative to the present poses.

    Raises
    ------
    OptionError : the session refuses an edit; those before it stay queued
    """
    for name in edits.add:
        session.add(name)
    for step in edits.move:
        session.move(step.name, moved_pose(session.pose(step.name), step))
    for name in edits.remove:
        session.remove(name)
    for setting in edits.dim:
        for group in meant_by(setting.name, list(session.dim_factors)):
            session.dim(group, setting.values[0])
    for setting in edits.reflectance:
        session.set_reflectance(setting.name, setting.values)


def moved_pose(pose: np.ndarray, step: Move) -> np.ndarray:
    """Return `pose` (4x4) rotated about +Y through its own origin and translated.

    Parameters
    ----------
    pose : (4, 4) local to world, column vectors
    step : offset in metres, angle in degrees, counter-clockwise seen from above
    """
    angle = math.radians(step.degrees)
    c, s = math.cos(angle), math.sin(angle)
    result = np.array(pose, dtype=np.float64)
    if step.degrees:
        result[:3, :3] = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]]) @ result[:3, :3]
    result[:3, 3] += step.offset
    return result


def edits_of_json(content: bytes) -> Edits:
    """Read edits as JSON; each kind is checked like the option of its name.

    Raises
    ------
    OptionError : not JSON, an unknown kind, or a value that the option would refuse
    """
    data = _json_object(content)
    if unknown := [key for key in data if key not in KINDS]:
        raise OptionError(f"found {_shown(unknown[0])}, expected edits by kind: {', '.join(KINDS)}")
    return Edits(
        add=_names(data, "add"),
        remove=_names(data, "remove"),
        move=_settings(data, "move", parse_move),
        dim=_settings(data, "dim", parse_dim),
        reflectance=_settings(data, "reflectance", parse_reflectance),
    )


def _json_object(content: bytes) -> dict[str, Any]:
    def unique(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        seen: set[str] = set()
        for key, _ in pairs:
            if key in seen:
                raise OptionError(f"found {_shown(key)} twice in one object, expected it once")
            seen.add(key)
        return dict(pairs)

    try:
        data = json.loads(content.decode("utf-8-sig"), object_pairs_hook=unique)
    except UnicodeDecodeError as error:
        raise OptionError(f"found bytes that are no UTF-8 text (at {error.start}), expected JSON") from None
    except json.JSONDecodeError as error:
        at = f"line {error.lineno}, column {error.colno}"
        raise OptionError(f"found no JSON at {at}: {error.msg}") from None
    except (ValueError, RecursionError) as error:
        if isinstance(error, OptionError):
            raise
        raise OptionError(f"found no JSON that can be read ({error})") from None
    if not isinstance(data, dict):
        raise OptionError(f"found {_shown(data)}, expected an object of edits by kind: {', '.join(KINDS)}")
    return data


def _names(data: dict[str, Any], kind: str) -> list[str]:
    names = data.get(kind, [])
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise OptionError(f"{kind}: found {_shown(names)}, expected a list of names")
    return names


def _settings(data: dict[str, Any], kind: str, parse: Callable[[str], Any]) -> list[Any]:
    settings = data.get(kind, {})
    if not isinstance(settings, dict):
        raise OptionError(f"{kind}: found {_shown(settings)}, expected an object: name to numbers")
    found = []
    for name, value in settings.items():
        numbers = value if isinstance(value, list) else [value]
        if not numbers or not all(isinstance(n, (int, float)) and not isinstance(n, bool) for n in numbers):
            raise OptionError(f"{kind}: {_shown(name)}: found {_shown(value)}, expected numbers")
        try:
            found.append(parse(f"{name}={','.join(map(repr, numbers))}"))
        except typer.BadParameter as error:
            raise OptionError(f"{kind}: {error.message}") from None
    return found


def _shown(value: Any) -> str:
    text = json.dumps(value)
    return text if len(text) <= 60 else text[:57] + "…"
