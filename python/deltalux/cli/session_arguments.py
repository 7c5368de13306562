# SPDX-License-Identifier: Apache-2.0
"""Gives commands the options of a session, by name, with the defaults that the session has."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from typing import Any, TypeVar

from deltalux.session_options import SessionOptions, options_of

from .options import SESSION_OPTIONS

Command = TypeVar("Command", bound=Callable[..., None])
WHEN_OPENED = ("threads",)  # options that are given anew when a stored session is opened


def names_of(declaration: type = SessionOptions, without: tuple[str, ...] = ()) -> list[str]:
    """Names of the options that a TypedDict declares and the command line has, except those of `without`."""
    declared = options_of(declaration)
    return [name for name in SESSION_OPTIONS if name in declared and name not in without]


def of_the_bake(without: tuple[str, ...] = ()) -> tuple[str, ...]:
    """Names of the options whose values a stored session determines."""
    return tuple(name for name in names_of(without=without) if name not in WHEN_OPENED)


def session_arguments(
    declaration: type = SessionOptions, without: tuple[str, ...] = ()
) -> Callable[[Command], Command]:
    """Replace a command's parameter `session` by the options of a session; the command gets a dict of them.

    Parameters
    ----------
    declaration : TypedDict of the options that the command can use
    without : options that the command defines itself
    """
    names = names_of(declaration, without)
    declared = options_of(declaration)

    def decorate(command: Command) -> Command:
        parameters = []
        for parameter in inspect.signature(command, eval_str=True).parameters.values():
            if parameter.name != "session":
                parameters.append(parameter)
                continue
            for name in names:
                kind, default = inspect.Parameter.KEYWORD_ONLY, declared[name].default
                parameters.append(
                    inspect.Parameter(name, kind, default=default, annotation=SESSION_OPTIONS[name])
                )

        @functools.wraps(command)
        def called(**given: Any) -> None:
            session = {name: given.pop(name) for name in names}
            command(**given, session=session)

        called.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
        called.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
        return called  # type: ignore[return-value]

    return decorate
