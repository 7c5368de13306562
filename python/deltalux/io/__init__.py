# SPDX-License-Identifier: Apache-2.0
"""Readers: they convert files to Scenes."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from deltalux.errors import Error, OptionError
from deltalux.scene import Scene, replace_scene

from .diagnostics import MISSING_REFLECTANCE
from .glass import LITERAL
from .glass import OPTIONS as GLASS
from .gltf import GROUPINGS, load_gltf
from .obj import load_obj
from .space import size_questions, space_matrix

LIGHT_UNITS = ("spec", "blender-watts", "unitless")
LOADERS = {".gltf": load_gltf, ".glb": load_gltf, ".obj": load_obj}


# Formats of other programs: suffixes, and the remedy.
EXPORTS = {
    "USD": ((".usd", ".usda", ".usdc", ".usdz"), "import it into Blender and export glTF 2.0 (.glb)"),
    "FBX": ((".fbx",), "import it into Blender and export glTF 2.0 (.glb)"),
    "Blender's": ((".blend",), "export glTF 2.0 (.glb) from Blender, with punctual lights and +Y up"),
    "IFC": ((".ifc", ".ifczip"), "convert it with IfcOpenShell's IfcConvert (IfcConvert in.ifc out.glb)"),
}


def load(
    path: str | Path,
    *,
    movable: Iterable[str] = (),
    light_units: str = "spec",
    unit: str | float | None = None,
    up: str = "y",
    groups: str = "auto",
    glass: str = LITERAL,
    reflectance: float = MISSING_REFLECTANCE,
) -> Scene:
    """Read a scene from a file; the suffix (.glb, .gltf, .obj) says how.

    Parameters
    ----------
    path : str or Path
    movable : names of nodes (objects in OBJ) that may be moved, removed and added
        Each becomes one movable mesh with everything below it; ``*``, ``?`` and ``[...]`` describe several.
        Nodes named ``MOVE_...`` and nodes with ``extras.movable`` become movable without being listed.
    light_units : "spec", "blender-watts" or "unitless"
        Meaning of the numbers of KHR_lights_punctual; see `deltalux.io.gltf.lights`.
    unit : "mm", "cm", "m", "in", "ft", or metres per unit
        Unit of the file's lengths; None = metres, with a warning if the scene's size is unusual. The unit
        does not change the lights' candela, lux and cd/m2.
    up : "y" or "z", the file's upward axis
    groups : "lamp", "name" or "auto"
        Light groups of lamps for which the file gives none (``extras.group``): "lamp", each lamp is a group;
        "name", lamps on nodes of one name share a group; "auto", as "lamp" if there are at most eight groups,
        which can be dimmed at once, else as "name".
    glass : "literal", "window", "clear" or "opaque"
        What becomes of transparent surfaces that do not glow. "literal": light passes as the file says
        (KHR_materials_transmission, and the alpha of BLEND in glTF; d or Tr in MTL). "window": likewise, but
        what lets at least half of it through counts as a pane of 6 mm, of which 88 % of the light passes at
        a right angle. "clear": that is left out, so that light passes it unchanged; results and exports lack
        it. "opaque": all surfaces count as their diffuse colour.
    reflectance : of surfaces for which the file gives no material, 0 to 1
        glTF's own default is a perfect white, between whose walls light never ends.

    Returns
    -------
    Scene
        `Scene.unit` is "lux" for glTF read to the letter, else "W/m2"; `Scene.warnings` lists what
        the file holds but Deltalux does not honour.

    Raises
    ------
    OptionError
        The suffix, a name in `movable`, `light_units`, `unit`, `up`, `groups` or `glass` is unknown, or
        `reflectance` is beyond 0 to 1.
    FormatError
        The file is absent, malformed, or needs an unsupported feature.
    SceneError
        The file is well-formed but there is nothing to light, or it does not fit into memory.
    """
    path = Path(path)
    loader = LOADERS.get(path.suffix.lower())
    if loader is None:
        raise OptionError(
            f'"{path.name}": found suffix "{path.suffix}", expected one of {", ".join(LOADERS)}'
            f"{_remedy(path)}"
        )
    if light_units not in LIGHT_UNITS:
        raise OptionError(f"light_units: found {light_units!r}, expected one of {', '.join(LIGHT_UNITS)}")
    if groups not in GROUPINGS:
        raise OptionError(f"groups: found {groups!r}, expected one of {', '.join(GROUPINGS)}")
    if glass not in GLASS:
        raise OptionError(f"glass: found {glass!r}, expected one of {', '.join(GLASS)}")
    if not 0 <= reflectance <= 1:
        raise OptionError(f"reflectance: found {reflectance!r}, expected a number from 0 to 1")
    names = (movable,) if isinstance(movable, str) else tuple(movable)
    space = space_matrix(unit, up)
    try:
        scene = loader(path, names, light_units, space, groups, glass=glass, reflectance=reflectance)
        questions = size_questions(scene) if unit is None else []
        return replace_scene(scene, warnings=[*scene.warnings, *questions]) if questions else scene
    except Error as error:
        # Inner functions add the place in the file; only this one adds the file's name.
        raise type(error)(f"{path.name}: {error}") from error.__cause__


def _remedy(path: Path) -> str:
    for kind, (suffixes, remedy) in EXPORTS.items():
        if path.suffix.lower() in suffixes:
            return f"; {kind} files are not read: {remedy}"
    return ""
