# SPDX-License-Identifier: Apache-2.0
"""Command lines by the program's own grammar: its verbs and options, with values good, odd and hostile."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import typer.main
from deltalux.cli import app

from fuzz.mutate_json import Rng, pick

_NUMBERS = """0 1 2 0.5 0.25 0.05 -1 -0 nan inf -inf 1e-200
1e-320 1e300 1e999 9e18 1e19 0x10 1_0 1,5 ½ ٣ x"""
NUMBERS = _NUMBERS.split()
TEXTS = [
    "",
    " ",
    "--",
    "-",
    "=",
    ",",
    "x" * 5000,
    "\udcff",
    "ünï",
    "[red]",
    "%s",
    "a\nb",
    "\x1b[31m",
    "*",
    "~",
    "..",
    "/",
]
COUNTS = ["1", "2", "100", "1000", "1e3", "3000", "1e15", "9e18"]  # few, or more than any memory holds
NAMES = ["MOVE_panel", "panel", "floor", "lamp", "grey", "oak", "block", "desk", "paint", "nobody", ""]
SCENES = ["room.glb"] * 6 + [
    "room.obj",
    "room.dlx",
    "damaged.glb",
    "empty.glb",
    "no.glb",
    "folder",
    "text.txt",
]
SCENES += ["cornell_box", "cornell-box", "cornel"]
SESSIONS = ["room.dlx"] * 8 + ["damaged.dlx", "room.glb", "no.dlx", "folder", "text.txt", "result.npz"]
RESULTS = ["result.npz"] * 4 + ["result.csv", "damaged.npz", "room.dlx", "no.npz", "folder", "text.txt"]
OUTPUTS = [
    "out.glb",
    "out.csv",
    "out.npz",
    "out.dlx",
    "out.png",
    "room.glb",
    "room.dlx",
    "no/out.glb",
    "folder",
]
OUTPUTS += [
    "/dev/full",
    "/dev/null",
    "out",
    "out.GLB",
    ".glb",
    "out.txt",
    "folder/out.csv",
    "text.txt/out.npz",
]
# Commands that work for long, or until they are stopped, are interrupted; wide ones are asked less often.
VERBS = ["bake"] * 8 + ["update"] * 8 + ["info"] * 4 + ["compare"] * 4 + ["plan"] * 3 + ["view", "study"]
VERBS += ["compare-methods", "demo", "serve"]


def _list_of_numbers(rng: Rng, count: int) -> str:
    return ",".join(str(pick(rng, NUMBERS[:12])) for _ in range(count + int(pick(rng, [0, 0, 0, -1, 1]))))


def _small(rng: Rng) -> str:
    return f"{rng.uniform(-0.3, 0.3):.3f}"


def _move(rng: Rng) -> str:
    if rng.random() < 0.5:
        return f"MOVE_panel={_small(rng)},0,{_small(rng)}" + str(pick(rng, ["", ",30", ",1e300"]))
    return f"{pick(rng, NAMES)}={_list_of_numbers(rng, 3)}"


def _grid(rng: Rng) -> str:
    if rng.random() < 0.5:
        return "-1,0.8,-1,2,2,0.5"
    return _list_of_numbers(rng, 6)


def _any(rng: Rng) -> str:
    return str(pick(rng, [*NUMBERS, *TEXTS, *NAMES]))


# By option: how a value is made; others take anything.
VALUES: dict[str, Callable[[Rng], str]] = {
    "--paths": lambda rng: str(pick(rng, [*COUNTS, *NUMBERS])),
    "--samples": lambda rng: str(pick(rng, [*COUNTS, *NUMBERS])),
    "--spacing": lambda rng: str(pick(rng, ["0.5", "1", "1e300", *NUMBERS])),
    "--radius": lambda rng: str(pick(rng, ["0.2", *NUMBERS])),
    "--target-error": lambda rng: str(pick(rng, ["0.5", "0.1", *NUMBERS])),
    "--threads": lambda rng: str(pick(rng, ["1", "2", "0", "-1", "99999999999", "x"])),
    "--seed": lambda rng: str(pick(rng, ["0", "7", "-1", str(2**64 - 1), str(2**64), "1e3", "x"])),
    "--memory-limit": lambda rng: str(
        pick(rng, ["200M", "1G", "1", "1K", "0", "-1G", "1e30T", "nan", "B", "T"])
    ),
    "--movable": lambda rng: str(pick(rng, NAMES)),
    "--move": _move,
    "--remove": lambda rng: str(pick(rng, NAMES)),
    "--add": lambda rng: str(pick(rng, NAMES)),
    "--dim": lambda rng: f"{pick(rng, ['lamp', 'lamp', *NAMES])}={pick(rng, NUMBERS)}",
    "--reflectance": lambda rng: (
        f"{pick(rng, ['grey', 'oak', *NAMES])}={_list_of_numbers(rng, int(pick(rng, [1, 3])))}"
    ),
    "--grid": _grid,
    "--watch": lambda rng: str(pick(rng, ["edits.json", "edits.json", "room.glb", "folder", "no.json", ""])),
    "--output": lambda rng: str(pick(rng, OUTPUTS)),
    "--folder": lambda rng: str(pick(rng, ["folder", "no", "text.txt", "."])),
    "--light-units": lambda rng: str(pick(rng, ["spec", "blender-watts", "unitless", "SPEC", "lux"])),
    "--host": lambda rng: str(
        pick(rng, ["127.0.0.1", "localhost", "::1", "256.0.0.1", "", "x" * 300, "\udcff"])
    ),
    "--port": lambda rng: str(pick(rng, ["0", "1", "65535", "65536", "-1", "x"])),
}
ARGUMENTS: dict[str, list[str]] = {
    "scene": SCENES,
    "session": SESSIONS,
    "source": [*SCENES, *SESSIONS],
    "a": RESULTS,
    "b": RESULTS,
    "name": ["all", "nobody", "fig6", ""],
}


def command_line(rng: Rng) -> tuple[list[str], list[str]]:
    """The words after the program's name, and those of them that name inputs."""
    group: Any = typer.main.get_command(app)
    verb = str(pick(rng, VERBS)) if rng.random() < 0.97 else _any(rng)
    if verb not in group.commands:
        return [verb, *(_any(rng) for _ in range(rng.integers(3)))], []
    calm = rng.random() < 0.6  # little that is wrong, so that work begins
    words, inputs, given = [], [], set()
    for parameter in group.commands[verb].params:
        if parameter.name == "more":
            continue
        if parameter.param_type_name == "argument":
            known = ARGUMENTS[parameter.name]
            if calm or rng.random() < 0.95:
                inputs.append(known[0] if calm else str(pick(rng, known)))
            continue
        option = max(parameter.opts, key=len)
        for _ in range(2):
            if rng.random() < (0.05 if calm else 0.1):
                given.add(option)
                name = str(pick(rng, parameter.opts))
                words += [name] if parameter.is_flag else [name, _value(rng, option)]
    known_options = {option for parameter in group.commands[verb].params for option in parameter.opts}
    if "-o" in known_options and "--output" not in given and verb != "demo":
        words += ["-o", str(pick(rng, OUTPUTS[:5] if calm else OUTPUTS))]
        words += [str(pick(rng, OUTPUTS))] if rng.random() < 0.1 else []
    words = [verb, *inputs, *words, *_cheap(known_options - given), *(["--no-browser"] * (verb == "view"))]
    return words if calm else _misspelt(rng, words), inputs


def _cheap(options: set[str]) -> list[str]:
    """What keeps work small, of these options."""
    words: list[str] = []
    for option, value in (("--paths", "1000"), ("--spacing", "0.7"), ("--threads", "1")):
        words += [option, value] if option in options else []
    return words


def _misspelt(rng: Rng, words: list[str]) -> list[str]:
    """A word that is another, or one too many."""
    if rng.random() < 0.05:
        words[rng.integers(1, len(words))] = _any(rng)
    if rng.random() < 0.05:
        words.insert(
            int(rng.integers(len(words) + 1)), str(pick(rng, ["--help", "--version", "--nothing", "-x"]))
        )
    return words


def _value(rng: Rng, option: str) -> str:
    return _any(rng) if rng.random() < 0.08 else VALUES.get(option, _any)(rng)
