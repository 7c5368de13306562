# SPDX-License-Identifier: Apache-2.0
"""Options shared by several commands, and the parsers of their values."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal

import typer

from deltalux.io import MISSING_REFLECTANCE
from deltalux.io.space import METRES
from deltalux.rendering import LARGEST
from deltalux.session_options import PATHS_OF_DISCS, PATHS_OF_RAYS, rays_in_words

SESSION = ".dlx"  # suffix of session files
AUTO, NONE = "auto", "none"  # values of lengths: chosen from the scene, and none
LightUnits = Literal["spec", "blender-watts", "unitless"]
_SIZES = {"": 1, "K": 2**10, "M": 2**20, "G": 2**30, "T": 2**40}


@dataclass(frozen=True)
class Grid:
    """Horizontal working plane facing up: corner, extent along +X and +Z, spacing; metres."""

    corner: tuple[float, float, float]
    width: float
    depth: float
    spacing: float


@dataclass(frozen=True)
class Move:
    """Relative rigid motion of a movable: metres, and degrees about +Y through its own origin."""

    name: str
    offset: tuple[float, float, float]
    degrees: float


@dataclass(frozen=True)
class Setting:
    """A name with one or three numbers (a light group's factor, a material's reflectance)."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True)
class Lamp:
    """A lamp to be added: metres, None for a place of the program's choice; power, None for a usual one."""

    place: tuple[float, float, float] | None
    power: float | None


@dataclass(frozen=True)
class Sun:
    """The sun to be added: degrees, and irradiance on a plane that faces it, None for a clear sky's."""

    azimuth: float
    elevation: float
    irradiance: float | None


def _numbers(text: str, counts: tuple[int, ...], form: str, whole: str | None = None) -> list[float]:
    """Parse comma-separated numbers; error messages show `whole`, the value that contains `text`."""
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) not in counts or not all(math.isfinite(v) for v in values):
        raise typer.BadParameter(f"found '{whole or text}', expected {form}")
    return values


def _named(text: str, form: str) -> tuple[str, str]:
    name, equals, rest = text.rpartition("=")  # node names may contain "="
    if not equals or not name:
        raise typer.BadParameter(f"found '{text}', expected {form}")
    return name, rest


def parse_grid(text: str) -> Grid:
    """Parse X,Y,Z,WIDTH,DEPTH,SPACING."""
    x, y, z, width, depth, spacing = _numbers(text, (6,), "X,Y,Z,WIDTH,DEPTH,SPACING in metres")
    if min(width, depth, spacing) <= 0:
        raise typer.BadParameter(f"found '{text}', expected WIDTH, DEPTH and SPACING above 0")
    return Grid((x, y, z), width, depth, spacing)


def parse_move(text: str) -> Move:
    """Parse NAME=dx,dy,dz[,degrees]."""
    form = "NAME=dx,dy,dz[,degrees about +Y]"
    name, rest = _named(text, form)
    dx, dy, dz, *turn = _numbers(rest, (3, 4), form, text)
    return Move(name, (dx, dy, dz), turn[0] if turn else 0.0)


def parse_dim(text: str) -> Setting:
    """Parse GROUP=factor."""
    name, rest = _named(text, "GROUP=factor")
    (factor,) = _numbers(rest, (1,), "GROUP=factor", text)
    if factor < 0:
        raise typer.BadParameter(f"found '{text}', expected a factor of 0 or more (1 = as loaded)")
    return Setting(name, (factor,))


def parse_reflectance(text: str) -> Setting:
    """Parse MATERIAL=r,g,b or MATERIAL=grey."""
    form = "MATERIAL=r,g,b with values from 0 to 1"
    name, rest = _named(text, form)
    values = _numbers(rest, (1, 3), form, text)
    if min(values) < 0 or max(values) > 1:
        raise typer.BadParameter(f"found '{text}', expected {form}")
    return Setting(name, tuple(values * 3 if len(values) == 1 else values))


def parse_lamp(text: str) -> Lamp:
    """Parse X,Y,Z[,LUMENS], or auto."""
    if text == AUTO:
        return Lamp(None, None)
    form = "X,Y,Z in metres, with LUMENS of 0 or more, or auto"
    x, y, z, *power = _numbers(text, (3, 4), form)
    if power and power[0] < 0:
        raise typer.BadParameter(f"found '{text}', expected {form}")
    return Lamp((x, y, z), power[0] if power else None)


def parse_sun(text: str) -> Sun:
    """Parse AZIMUTH,ELEVATION[,LUX]."""
    form = "AZIMUTH,ELEVATION in degrees, the latter from -90 to 90, with LUX of 0 or more"
    azimuth, elevation, *irradiance = _numbers(text, (2, 3), form)
    if abs(elevation) > 90 or min(irradiance, default=0) < 0:
        raise typer.BadParameter(f"found '{text}', expected {form}")
    return Sun(azimuth, elevation, irradiance[0] if irradiance else None)


def parse_count(text: str) -> int:
    """Parse a positive whole number, also written as 1e6 or 1_000_000."""
    try:
        value = float(text)
    except ValueError:
        value = 0.0
    if not (1 <= value < 2**63 and value == math.floor(value)):
        raise typer.BadParameter(f"found '{text}', expected a whole number above 0, such as 1e6")
    return int(value)


def parse_place(text: str) -> tuple[float, float, float]:
    """Parse X,Y,Z."""
    x, y, z = _numbers(text, (3,), "X,Y,Z in metres")
    return x, y, z


def parse_size(text: str) -> tuple[int, int]:
    """Parse WxH."""
    width, _, height = text.lower().partition("x")
    if not (
        width.isdecimal() and height.isdecimal() and all(1 <= int(n) <= LARGEST for n in (width, height))
    ):
        raise typer.BadParameter(f"found '{text}', expected WIDTHxHEIGHT, such as 1920x1080, up to {LARGEST}")
    return int(width), int(height)


def parse_gather(text: str) -> str | int:
    """Parse a number of rays, or auto, or off."""
    return text if text in ("auto", "off") else parse_count(text)


def parse_positive(text: str) -> float:
    """Parse a positive number."""
    (value,) = _numbers(text, (1,), "a number above 0")
    if value <= 0:
        raise typer.BadParameter(f"found '{text}', expected a number above 0")
    return value


def parse_unit(text: str) -> str | float:
    """Parse the name of a unit of length, or its length in metres."""
    if text in METRES:
        return text
    form = f"one of {', '.join(METRES)}, or how many metres one unit has"
    (value,) = _numbers(text, (1,), form)
    if value <= 0:
        raise typer.BadParameter(f"found '{text}', expected {form}")
    return value


def parse_detail(text: str) -> float | str:
    """Parse a positive number, "auto" or "none"."""
    return text if text in (AUTO, NONE) else parse_positive(text)


def parse_bytes(text: str) -> int:
    """Parse a size in bytes with an optional K, M, G or T (powers of 1024)."""
    body = text.strip().upper().removesuffix("B").removesuffix("I")
    unit = body[-1:] if body[-1:] in _SIZES else ""
    (value,) = _numbers(body.removesuffix(unit), (1,), "a size such as 4G or 800M", text)
    size = value * _SIZES[unit]
    if not 0 < size < 2**63:
        raise typer.BadParameter(f"found '{text}', expected a size above 0 and below 8388608T, such as 4G")
    return int(size)


SceneArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE",
        help="A .glb, .gltf or .obj file, a session (.dlx), whose scene is taken as it was edited, or a "
        "bundled scene: atrium, expo, office, cornell_box.",
        show_default=False,
    ),
]
SourceArgument = Annotated[
    str,
    typer.Argument(
        metavar="SCENE|SESSION.dlx",
        help="A .glb, .gltf or .obj file, a bundled scene (atrium, expo, office, cornell_box), or a session "
        "that bake, update or the viewer wrote.",
        show_default=False,
    ),
]
SessionArgument = Annotated[
    Path,
    typer.Argument(metavar="SESSION.dlx", help="A session that bake or update wrote.", show_default=False),
]
MovableOption = Annotated[
    list[str] | None,
    typer.Option(
        "--movable",
        metavar="NAME",
        help="Make this node movable (repeatable); 'chair*' means all whose names begin so. "
        "Nodes named MOVE_… are movable anyway. `deltalux info SCENE --nodes` shows all names.",
    ),
]
LampOption = Annotated[
    list[Lamp] | None,
    typer.Option(
        "--lamp",
        parser=parse_lamp,
        metavar="X,Y,Z[,LUMENS]|auto",
        help="Add a lamp to the scene (repeatable): its place, metres, and its power, chosen when not given. "
        "auto: the place is chosen, too, high in the widest room.",
    ),
]
SunOption = Annotated[
    Any,
    typer.Option(
        "--sun",
        parser=parse_sun,
        metavar="AZIMUTH,ELEVATION[,LUX]",
        help="Add the sun to the scene: degrees about +Y, from +Z towards +X; degrees above the horizon; "
        "light on a plane that faces it, that of a clear sky when not given.",
        show_default=False,
    ),
]
LightUnitsOption = Annotated[
    LightUnits,
    typer.Option(
        "--light-units",
        help="Units of the file's lights: as glTF prescribes (candela, lux), "
        "watts as in old Blender exports, or none.",
    ),
]
UnitOption = Annotated[
    Any,  # a name in METRES, or metres
    typer.Option(
        "--unit",
        parser=parse_unit,
        metavar="mm|cm|m|in|ft|METRES",
        help="Unit of the file's lengths; metres when not given, as glTF prescribes.",
        show_default=False,
    ),
]
UpOption = Annotated[Literal["y", "z"], typer.Option("--up", help="The file's upward axis.")]
GroupsOption = Annotated[
    Literal["auto", "lamp", "name"],
    typer.Option(
        "--groups",
        help="Light groups of a glTF file's lamps without extras.group: one per lamp (lamp), one per name "
        "(name), or one per lamp as long as eight groups, which can be dimmed at once, are enough (auto).",
    ),
]
GlassOption = Annotated[
    Literal["literal", "window", "clear", "opaque"],
    typer.Option(
        "--glass",
        help="What is transparent lets light pass as the file says (literal). What lets at least half of it "
        "through may count as panes of 6 mm (window), or be left out (clear). Or all counts as its diffuse "
        "colour (opaque).",
    ),
]
MissingOption = Annotated[
    float,
    typer.Option(
        "--reflectance",
        min=0.0,
        max=1.0,
        metavar="R",
        help="Reflectance of surfaces for which the file gives no material, 0 to 1.",
    ),
]
OutputsOption = Annotated[
    list[Path] | None,
    typer.Option(
        "-o",
        "--output",
        metavar="OUT…",
        help="Result file, its kind by suffix (repeatable, or several after one -o): .glb lit mesh, "
        ".png picture, .csv and .npz numbers, .dlx session for later updates.",
        show_default=False,
    ),
]
MoreOutputsArgument = Annotated[
    list[Path] | None, typer.Argument(metavar="-o OUT", hidden=True, show_default=False)
]
FalseColourOption = Annotated[
    bool, typer.Option("--false-colour", help="Pictures show irradiance in false colour, with a legend.")
]
CameraOption = Annotated[
    str | None,
    typer.Option(
        "--camera",
        metavar="NAME",
        help="Pictures show what this camera of the scene sees; its first one when not given, and if there "
        "is none, a good view.",
    ),
]
EyeOption = Annotated[
    Any,
    typer.Option("--eye", parser=parse_place, metavar="X,Y,Z", help="Position of the camera, metres."),
]
TargetOption = Annotated[
    Any,
    typer.Option("--target", parser=parse_place, metavar="X,Y,Z", help="Point to look at from --eye."),
]
SizeOption = Annotated[
    Any,
    typer.Option(
        "--size", parser=parse_size, metavar="WxH", help="Pixels of pictures.  [dim]\\[default: 960x600][/]",
        show_default=False,
    ),
]  # fmt: skip
ExposureOption = Annotated[
    float, typer.Option("--exposure", metavar="EV", help="Stops brighter than metered; -1 halves the light.")
]
GatherOption = Annotated[
    str,
    typer.Option(
        "--gather",
        parser=parse_gather,
        metavar="N|auto|off",
        help="Final-gather rays per sample: four times as many halve the noise. auto: "
        f"{rays_in_words()}. off: light from discs, biased beside objects.",
    ),
]
PathsOption = Annotated[
    int | None,
    typer.Option(
        "--paths",
        parser=parse_count,
        metavar="N",
        help="Light paths to trace.  "
        f"[dim]\\[default: {PATHS_OF_RAYS}; with --gather off: {PATHS_OF_DISCS}][/]",
        show_default=False,
    ),
]
TargetErrorOption = Annotated[
    float | None,
    typer.Option(
        "--target-error",
        parser=parse_positive,
        metavar="F",
        help="Add paths and rays until nine tenths of the lit surface have a relative standard error below F "
        "(0.02 = 2 %).",
    ),
]
SpacingOption = Annotated[
    float | None,
    typer.Option(
        "--spacing",
        parser=parse_positive,
        metavar="METRES",
        help="Distance between samples on the surfaces; from the scene's size when not given.",
    ),
]
DetailOption = Annotated[
    Any,  # metres, AUTO or NONE
    typer.Option(
        "--detail",
        parser=parse_detail,
        metavar="METRES",
        help="Refine what is shown to this length where shadows and pools of spots have edges; a quarter of "
        'the spacing when not given, "none" for no such refinement.',
    ),
]
GridOption = Annotated[
    list[Grid] | None,
    typer.Option(
        "--grid",
        parser=parse_grid,
        metavar="X,Y,Z,WIDTH,DEPTH,SPACING",
        help="Sample a horizontal working plane instead of the surfaces (repeatable): its corner, "
        "its extent along +X and +Z, the distance between samples; metres. Points inside of walls and "
        "furniture are left out.",
    ),
]
MarginOption = Annotated[
    float,
    typer.Option(
        "--margin",
        min=0.0,
        metavar="METRES",
        help="Leave out points of --grid nearer than this to a wall or to furniture at their height.",
    ),
]
RadiusOption = Annotated[
    float | None,
    typer.Option(
        "--radius",
        parser=parse_positive,
        metavar="METRES",
        help="Radius of every sample's disc; chosen per sample when not given.",
    ),
]
SeedOption = Annotated[
    int,
    typer.Option("--seed", min=0, metavar="N", help="Seed of random numbers: equal seeds give equal bits."),
]
ThreadsOption = Annotated[
    int | None,
    typer.Option(
        "--threads", min=1, metavar="N", help="Processors to use; all when not given. Never changes a result."
    ),
]
MemoryLimitOption = Annotated[
    int | None,
    typer.Option(
        "--memory-limit",
        parser=parse_bytes,
        metavar="SIZE",
        help="Refuse a job that would need more memory, such as 4G; the free memory when not given.",
    ),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on stdout.")]
QuietOption = Annotated[bool, typer.Option("-q", "--quiet", help="Print nothing but errors (and --json).")]

# Options of a session that the command line has, by the names that deltalux.session_options declares.
SESSION_OPTIONS: dict[str, Any] = {
    "paths": PathsOption,
    "gather": GatherOption,
    "seed": SeedOption,
    "threads": ThreadsOption,
    "memory_limit": MemoryLimitOption,
}
# How a scene is read, by the names of inputs.open_scene's parameters, each with its default. What a stored
# session's scene was read with cannot be given anew.
SCENE_OPTIONS: dict[str, tuple[Any, Any]] = {
    "movable": (MovableOption, None),
    "lamp": (LampOption, None),
    "sun": (SunOption, None),
    "light_units": (LightUnitsOption, "spec"),
    "unit": (UnitOption, None),
    "up": (UpOption, "y"),
    "groups": (GroupsOption, "auto"),
    "glass": (GlassOption, "literal"),
    "reflectance": (MissingOption, MISSING_REFLECTANCE),
}
OF_THE_SCENE = tuple(SCENE_OPTIONS)
