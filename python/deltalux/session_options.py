# SPDX-License-Identifier: Apache-2.0
"""The options of a session, each declared once: name, type, default, check, words, and what the core gets."""

from __future__ import annotations

import functools
import inspect
import textwrap
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypedDict, TypeVar, get_type_hints

import numpy as np

from . import _core
from .errors import OptionError
from .estimate.inputs import SEGMENT_ENDS, check_choice
from .memory import available_memory
from .segments import MAX_BOUNCES, check_bounces, check_integer, check_paths, check_seed, check_threads

DIRECT_MODES = ("auto", "paths", "sampled")
RAY_COUNTS = (8, 65536)  # bounds of the number of rays of a place
DISC_AREAS = ("reachable", "whole")
METHODS = ("auto", *_core.METHODS)
# Rays per sample with gather="auto": an entry applies if all samples together cast at most this many rays.
# More rays than 256, for few samples, cost no more time than 16,384 samples of 256 rays do. With fewer than
# 64 rays, light under narrow spots is far noisier than it should be.
RAYS = {1536: 1 << 22, 1024: 1 << 22, 512: 1 << 22, 256: 1 << 24, 128: 1 << 24, 64: 1 << 24}
PATHS_OF_RAYS, PATHS_OF_DISCS = 300_000, 1_000_000  # default numbers of paths, with a gather and without

Check = Callable[[str, Any, Mapping[str, Any]], Any]
Taker = TypeVar("Taker", bound=Callable[..., Any])


@dataclass(frozen=True)
class Option:
    """What is said of an option beside its name and its type.

    Parameters
    ----------
    default : the value where none is given
    check : called with name, value and the values of all options; raises OptionError, or returns the value
        to keep, which the session file's JSON can hold
    help : its entry in docstrings: what follows "name : ", and indented lines below
    to_core : makes of the value what the core gets under the option's name
    """

    default: Any
    check: Check
    help: str
    to_core: Callable[[Any], Any] = lambda value: value


def default_paths(gather: str | int) -> int:
    """Default number of paths: discs need many, whereas the cells that rays read need fewer."""
    return PATHS_OF_DISCS if gather == "off" else PATHS_OF_RAYS


def resolved_gather(gather: str | int, samples: int, segment_end: str, disc_area: str) -> str | int:
    """The value that "auto" stands for; any other value unchanged."""
    if gather != "auto":
        return gather
    if (segment_end, disc_area) != ("first", "reachable"):
        return "off"
    fitting = (rays for rays, together in RAYS.items() if rays * samples <= together)
    return next(fitting, "off")


def rays_in_words() -> str:
    """The numbers of rays that gather="auto" stands for, for help texts."""
    counts = [f"{rays} up to {together // rays:,}" for rays, together in RAYS.items()]
    return f"{counts[0]} samples, {', '.join(counts[1:])}, off beyond"


def gather_rays(gather: str | int) -> int:
    """Rays of each sample; 0: all light is estimated by discs.

    Raises
    ------
    OptionError
    """
    if gather == "off":
        return 0
    check_integer("gather", gather, *RAY_COUNTS)
    return int(gather)


def _one_of(choices: tuple[str, ...]) -> Check:
    def check(name: str, value: Any, _: Mapping[str, Any]) -> Any:
        check_choice(name, value, choices)
        return value

    return check


def _whole(refuse: Callable[[Any], None]) -> Check:
    """Check by `refuse`, which knows the name; NumPy's integers become Python's."""

    def check(name: str, value: Any, _: Mapping[str, Any]) -> Any:
        refuse(value)
        return None if value is None else int(value)

    return check


def _gather(name: str, value: Any, _: Mapping[str, Any]) -> Any:
    return gather_rays(value) or value


def _memory(name: str, value: Any, _: Mapping[str, Any]) -> Any:
    if value is None:
        return None
    number = isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, bool)
    if not number or not 1 <= value < 2**63 or int(value) != value:
        raise OptionError(f"{name}: found {value!r:.60}, expected bytes, or None for what is free")
    return int(value)


def _range(name: str, value: Any, options: Mapping[str, Any]) -> tuple[int, int] | None:
    """A list, as JSON has it, becomes a tuple."""
    if value is None:
        return None
    paths = int(options["paths"])
    pair = isinstance(value, tuple | list) and len(value) == 2
    whole = pair and all(isinstance(n, int | np.integer) and not isinstance(n, bool) for n in value)
    if not whole or not 0 <= value[0] <= value[1] <= paths:
        raise OptionError(
            f"{name}: found {value!r:.60}, expected (first, last) with 0 <= first <= last <= {paths}, "
            "the number of paths, or None for all of them"
        )
    return int(value[0]), int(value[1])


class PlanOptions(TypedDict, total=False):
    """The options of a session that `plan` takes, too."""

    paths: Annotated[
        int | None,
        Option(
            None,
            _whole(check_paths),
            "number of light paths, shared among the lights by importance;\n"
            f"    None = {PATHS_OF_RAYS:,} with a final gather, {PATHS_OF_DISCS:,} without",
        ),
    ]
    seed: Annotated[
        int, Option(1, _whole(check_seed), "the same seed gives the same bits, for every number of threads")
    ]
    threads: Annotated[
        int | None, Option(None, _whole(check_threads), "None = all processors", lambda value: value or 0)
    ]
    segment_end: Annotated[
        str,
        Option(
            "first",
            _one_of(SEGMENT_ENDS),
            '"first", "second" or "bounded"\n'
            "    Which segments of a path count where they cross a disc (docs/explanation). With reachable\n"
            '    discs "first" is unbiased.',
        ),
    ]
    disc_area: Annotated[
        str,
        Option(
            "reachable",
            _one_of(DISC_AREAS),
            '"reachable" or "whole"\n'
            '    "reachable": clip each disc to what is visible from its centre and divide by the clipped\n'
            '    area; "whole": the plain circle.',
        ),
    ]
    direct: Annotated[
        str,
        Option(
            "auto",
            _one_of(DIRECT_MODES),
            '"auto", "paths" or "sampled"\n'
            '    "paths": direct light by the first segments of the paths; "sampled": by shadow rays;\n'
            '    "auto": by whichever is cheaper for each light; with a gather, by shadow rays unless there\n'
            "    are very many lights.",
        ),
    ]
    max_bounces: Annotated[
        int, Option(MAX_BOUNCES, _whole(check_bounces), "largest number of segments of a path")
    ]
    gather: Annotated[
        str | int,
        Option(
            "auto",
            _gather,
            '"auto", "off" or a number of rays\n'
            "    Rays of each sample's final gather: they read the light of the surfaces that they hit,\n"
            '    which is right beside objects, too. "off": all reflected light is estimated by discs.\n'
            f'    "auto", where `segment_end` and `disc_area` are the defaults:\n'
            f"    {rays_in_words()}.\n"
            '    "auto" elsewhere: "off".',
            gather_rays,
        ),
    ]


class SessionOptions(PlanOptions, total=False):
    """The options of a session, as they are given: who leaves one out gets its default."""

    static_method: Annotated[
        str,
        Option(
            "auto",
            _one_of(METHODS),
            '"auto", "brute_force", "disc_index", "ray_map" or "sphere_cache"\n'
            "    How the crossings of segments with the discs of samples at rest are found. All methods\n"
            '    give the same bits; "auto" chooses by a pilot at every bake that needs discs (see `plan`):\n'
            "    with a gather, only for lights without shadow rays, and for gradients.",
        ),
    ]
    moving_method: Annotated[
        str,
        Option(
            "auto",
            _one_of(METHODS),
            "as `static_method`\n"
            '    The same for samples on movables. The paper\'s hybrid is "disc_index" with\n'
            '    "sphere_cache".',
        ),
    ]
    memory_limit: Annotated[
        int | None,
        Option(
            None,
            _memory,
            "bytes, or None = what is free; a bake that would need more is refused",
            lambda value: available_memory() if value is None else int(value),
        ),
    ]
    path_range: Annotated[
        tuple[int, int] | None,
        Option(
            None,
            _range,
            "(first, last), or None = all paths\n"
            "    For bakes that are shared among sessions: which part of the paths this one traces and\n"
            "    stores. It takes the same share, from first / paths to last / paths, of every batch of\n"
            "    every light's paths. A session with a part has no light to read;\n"
            "    `deltalux.session.ranges` adds up the sums of parts.",
        ),
    ]


def options_of(declaration: type) -> dict[str, Option]:
    """The options that a TypedDict declares, by name."""
    hints = get_type_hints(declaration, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items()}


OPTIONS = options_of(SessionOptions)


def checked_options(given: Mapping[str, Any], samples: int) -> dict[str, Any]:
    """Values of all options of a session with so many samples: given ones, or defaults, resolved and checked.

    Raises
    ------
    OptionError
    """
    values = {name: given.get(name, option.default) for name, option in OPTIONS.items()}
    values["gather"] = resolved_gather(values["gather"], samples, values["segment_end"], values["disc_area"])
    if values["paths"] is None:
        values["paths"] = default_paths(values["gather"])
    return {name: option.check(name, values[name], values) for name, option in OPTIONS.items()}


def core_options(options: Mapping[str, Any]) -> dict[str, Any]:
    """What the core gets; it refuses names that it does not have, and wants all that it has."""
    return {name: option.to_core(options[name]) for name, option in OPTIONS.items()}


def takes(declaration: type) -> Callable[[Taker], Taker]:
    """Let a function with `**options` refuse what `declaration` does not have, and show its options.

    In the docstring, "{options}" becomes the options' entries, "{names}" their names. Of a class it is the
    constructor that takes the options.
    """

    def decorate(taker: Taker) -> Taker:
        if isinstance(taker, type):
            taker.__init__ = _taking(taker.__init__, declaration)  # type: ignore[misc]
            shown: Any = taker
        else:
            shown = _taking(taker, declaration)
        shown.__doc__ = _with_entries(taker.__doc__, options_of(declaration))
        return shown

    return decorate


def _taking(function: Callable[..., Any], declaration: type) -> Callable[..., Any]:
    own = list(inspect.signature(function).parameters.values())
    others = [parameter for parameter in own if parameter.kind is not inspect.Parameter.VAR_KEYWORD]
    types = get_type_hints(declaration)
    options = [
        inspect.Parameter(
            name, inspect.Parameter.KEYWORD_ONLY, default=option.default, annotation=types[name]
        )
        for name, option in options_of(declaration).items()
    ]
    positional = [parameter for parameter in others if parameter.kind is not inspect.Parameter.KEYWORD_ONLY]
    keywords = [parameter for parameter in others if parameter.kind is inspect.Parameter.KEYWORD_ONLY]
    signature = inspect.signature(function).replace(parameters=[*positional, *options, *keywords])

    @functools.wraps(function)
    def checked(*args: Any, **kwargs: Any) -> Any:
        signature.bind(*args, **kwargs)  # raises TypeError as any call does
        return function(*args, **kwargs)

    checked.__signature__ = signature  # type: ignore[attr-defined]
    return checked


def _with_entries(doc: str | None, options: Mapping[str, Option]) -> str | None:
    if doc is None:  # python -OO
        return None
    entries = "\n".join(f"{name} : {option.help}" for name, option in options.items())
    lines = []
    for line in doc.replace("{names}", ", ".join(options)).split("\n"):
        margin = line[: len(line) - len(line.lstrip())]
        lines.append(textwrap.indent(entries, margin) if line.strip() == "{options}" else line)
    return "\n".join(lines)
