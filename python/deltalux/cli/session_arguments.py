# SPDX-License-Identifier: Apache-2.0
"""Gives commands the options of a session, or those of reading a scene, by name and with their defaults."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable, Mapping, Sequence
from typing import Any, TypeVar

import typer

from deltalux.session_options import SessionOptions, options_of

from .options import SCENE_OPTIONS, SESSION_OPTIONS

Command = TypeVar("Command", bound=Callable[..., None])
WHEN_OPENED = ("threads",)  # options that are given anew when a stored session is opened


def names_of(declaration: type = SessionOptions, without: tuple[str, ...] = ()) -> list[str]:
    """Names of the options that a TypedDict declares and the command line has, except those of `without`."""
    declared = options_of(declaration)
    return [name for name in SESSION_OPTIONS if name in declared and name not in without]


def of_the_bake(without: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Names of the options whose values a stored session determines."""
    return tuple(name for name in names_of(without=without) if name not in WHEN_OPENED)


def refuse_options_of_the_bake(context: typer.Context, source: str, names: Sequence[str], verb: str) -> None:
    """Raise BadParameter for options, by `names`, that a session already determines."""
    for name in names:
        origin = context.get_parameter_source(name)
        if origin is not None and origin.name == "COMMANDLINE":
            option = "--" + name.replace("_", "-")
            raise typer.BadParameter(f"'{source}' was baked already; leave out {option}, or {verb} the scene")


def session_arguments(
    declaration: type = SessionOptions, without: tuple[str, ...] = ()
) -> Callable[[Command], Command]:
    """Replace a command's parameter `session` by the options of a session; the command gets a dict of them.

    Parameters
    ----------
    declaration : TypedDict of the options that the command can use
    without : options that the command defines itself
    """
    declared = options_of(declaration)
    names = names_of(declaration, without)
    return _replaced("session", {name: (SESSION_OPTIONS[name], declared[name].default) for name in names})


def scene_arguments(without: tuple[str, ...] = ()) -> Callable[[Command], Command]:
    """Replace a command's parameter `reading` by the options of reading a scene; the command gets a dict.

    Parameters
    ----------
    without : options that mean nothing to the command
    """
    return _replaced("reading", {k: option for k, option in SCENE_OPTIONS.items() if k not in without})


def _replaced(parameter: str, options: Mapping[str, tuple[Any, Any]]) -> Callable[[Command], Command]:
    """Replace `parameter` by options, of each its annotation and its default."""

    def decorate(command: Command) -> Command:
        parameters = []
        for own in inspect.signature(command, eval_str=True).parameters.values():
            if own.name != parameter:
                parameters.append(own)
                continue
            for name, (annotation, default) in options.items():
                kind = inspect.Parameter.KEYWORD_ONLY
                parameters.append(inspect.Parameter(name, kind, default=default, annotation=annotation))

        @functools.wraps(command)
        def called(**given: Any) -> None:
            chosen = {name: given.pop(name) for name in options}
            command(**given, **{parameter: chosen})

        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {own.name: own.annotation for own in parameters}
        return called  # type: ignore[return-value]

    return decorate
