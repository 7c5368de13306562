# SPDX-License-Identifier: Apache-2.0
"""Session files (.dlx): one zip of arrays and a JSON index, versioned, whole or refused."""

from __future__ import annotations

import json
import math
import tokenize
import zipfile
import zlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .display_mesh import DisplayMesh
from .errors import FormatError, OptionError, SceneError
from .files import written_aside
from .samples import Samples
from .scene import Camera, Light, Material, Mesh, Node, PointLight, Scene, SpotLight, SunLight
from .segments import Progress, check_threads

if TYPE_CHECKING:
    from .session import Session

FORMAT = "deltalux-session"
VERSION = 5  # increases only when the layout changes
INDEX = "deltalux.json"

_LIGHTS: dict[str, tuple[type, tuple[str, ...]]] = {
    "point": (PointLight, ("position", "intensity")),
    "spot": (SpotLight, ("position", "direction", "intensity", "inner_angle", "outer_angle")),
    "sun": (SunLight, ("direction", "irradiance")),
}


def write(path: Path, session: Session) -> None:
    """Write `session` to `path`, beside and then renamed."""
    arrays: dict[str, np.ndarray] = {}
    index = {
        "format": FORMAT,
        "version": VERSION,
        "options": session._options,
        "scene": _pack_scene(session.scene, arrays),
        "samples": _pack_samples(session.samples, arrays),
        "baked": session.baked,
        "removed": sorted(session._removed),
        "poses": {name: pose.tolist() for name, pose in session._poses.items()},
        "factors": session._factors,
        "built_by": session._session().description(),
    }
    for name, data in session._session().save().items():
        arrays[f"core/{name}"] = np.frombuffer(data, np.uint8)
    with written_aside(path) as aside, zipfile.ZipFile(aside, "w", zipfile.ZIP_STORED) as archive:
        archive.writestr(INDEX, json.dumps(index))
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, np.ascontiguousarray(array), allow_pickle=False)


def read(path: Path, kind: type[Session], threads: int | None, progress: Progress | None) -> Session:
    """Open a file that `write` made.

    Raises
    ------
    FormatError
        Where it is missing, truncated, foreign, damaged or of another version.
    """
    check_threads(threads)
    try:
        with zipfile.ZipFile(path) as archive:
            index = json.loads(archive.read(INDEX))
            _check_index(path, index)
            # Reading an entry to its end verifies its checksum.
            arrays = {
                name.removesuffix(".npy"): _read_array(archive, name, path.stat().st_size)
                for name in archive.namelist()
                if name.endswith(".npy")
            }
    except FileNotFoundError:
        raise FormatError(f"{path}: no such file") from None
    except (zipfile.BadZipFile, zlib.error, KeyError, ValueError, EOFError, OSError) as error:
        raise FormatError(
            f"{path}: found a file that is truncated, damaged or no session, "
            f"expected one that Session.save wrote ({error})"
        ) from None
    try:
        return _restore(index, arrays, kind, threads, progress)
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from None
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OptionError, SceneError) as error:
        raise FormatError(f"{path}: the session's parts do not fit together ({error!r})") from None


def _check_index(path: Path, index: Any) -> None:
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise FormatError(f"{path}: found a foreign file, expected a session that Session.save wrote")
    if index.get("version") != VERSION:
        raise FormatError(
            f"{path}: found session format {index.get('version')}, this program reads {VERSION}; bake again"
        )


def _read_array(archive: zipfile.ZipFile, name: str, file_size: int) -> np.ndarray:
    """One array; memory is taken only for what the file really holds."""
    info = archive.getinfo(name)
    if info.compress_type != zipfile.ZIP_STORED or info.file_size > file_size:
        raise ValueError(f"{name} is compressed, or longer than the file")
    with archive.open(info) as file:
        try:
            if np.lib.format.read_magic(file) != (1, 0):
                raise ValueError(f"{name} is of another version")
            shape, fortran_order, dtype = np.lib.format.read_array_header_1_0(file)
        except (tokenize.TokenError, SyntaxError) as error:
            raise ValueError(f"{name} has a damaged header ({error})") from None
        if fortran_order or dtype.kind not in "biuf" or min(shape, default=0) < 0:
            raise ValueError(f"{name} is no plain array of numbers")
        if file.tell() + math.prod(shape) * dtype.itemsize != info.file_size:
            raise ValueError(f"{name} is longer or shorter than its header says")
        return np.frombuffer(bytearray(file.read()), dtype).reshape(shape)


def _restore(
    index: dict[str, Any],
    arrays: dict[str, np.ndarray],
    kind: type[Session],
    threads: int | None,
    progress: Progress | None,
) -> Session:
    options = dict(index["options"])
    if threads is not None:
        options["threads"] = threads
    scene = _unpack_scene(index["scene"], arrays)
    session = kind(scene, _unpack_samples(index["samples"], arrays), progress=progress, **options)
    core = {
        name.removeprefix("core/"): array.tobytes()
        for name, array in arrays.items()
        if name.startswith("core/")
    }
    session._prepare_choice()
    session._session().restore(core, progress)
    session._removed = set(index["removed"])
    session._poses = {name: np.array(pose) for name, pose in index["poses"].items()}
    session._factors = dict(index["factors"])
    session._box = np.frombuffer(core["world"], np.float32).reshape(2, 3)
    rows = np.frombuffer(core["reflectance"], np.float32).reshape(-1, 3)
    session._reflectances = {m.name: tuple(r) for m, r in zip(scene.materials, rows.tolist(), strict=True)}
    built_by = session._session().description()
    if session.baked and index["built_by"] != built_by:
        session.foreign_build = f"{index['built_by']}; this is {built_by}"
    return session


def _pack_scene(scene: Scene, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    meshes = []
    for i, mesh in enumerate(scene.meshes):
        arrays[f"mesh{i}/vertices"] = mesh.vertices
        arrays[f"mesh{i}/triangles"] = mesh.triangles
        arrays[f"mesh{i}/material_index"] = mesh.material_index
        meshes.append(
            {
                "name": mesh.name,
                "material": list(mesh.material),
                "pose": mesh.pose.tolist(),
                "movable": mesh.movable,
                "smooth_angle": mesh.smooth_angle,
            }
        )
    return {
        "unit": scene.unit,
        "warnings": list(scene.warnings),
        "source": None if scene.source is None else str(scene.source),
        "meshes": meshes,
        "materials": [
            {
                "name": m.name,
                "reflectance": m.reflectance.tolist(),
                "emission": m.emission.tolist(),
                "group": m.group,
                "two_sided": m.two_sided,
            }
            for m in scene.materials
        ],
        "lights": [_pack_light(light) for light in scene.lights],
        "cameras": [
            {"name": c.name, "pose": np.asarray(c.pose).tolist(), "vertical_fov": c.vertical_fov}
            for c in scene.cameras
        ],
        "nodes": [
            {"name": n.name, "parent": n.parent, "matrix": np.asarray(n.matrix).tolist(), "parts": n.parts}
            for n in scene.nodes
        ],
    }


def _pack_light(light: Light) -> dict[str, Any]:
    for kind, (cls, fields) in _LIGHTS.items():
        if isinstance(light, cls):
            values = {field: np.asarray(getattr(light, field)).tolist() for field in fields}
            return {
                "kind": kind,
                "name": light.name,
                "group": light.group,
                "attached_to": light.attached_to,
                **values,
            }
    raise TypeError(f"light of unknown type {type(light).__name__}")


def _unpack_scene(data: dict[str, Any], arrays: dict[str, np.ndarray]) -> Scene:
    meshes = [
        Mesh(
            vertices=arrays[f"mesh{i}/vertices"],
            triangles=arrays[f"mesh{i}/triangles"],
            material_index=arrays[f"mesh{i}/material_index"],
            **entry,
        )
        for i, entry in enumerate(data["meshes"])
    ]
    lights = []
    for entry in data["lights"]:
        values = dict(entry)
        lights.append(_LIGHTS[values.pop("kind")][0](**values))
    nodes = [
        Node(n["name"], n["parent"], np.array(n["matrix"]), tuple((p[0], p[1], p[2]) for p in n["parts"]))
        for n in data["nodes"]
    ]
    return Scene(
        meshes,
        [Material(**entry) for entry in data["materials"]],
        lights,
        unit=data["unit"],
        cameras=[Camera(c["name"], np.array(c["pose"]), c["vertical_fov"]) for c in data["cameras"]],
        nodes=nodes,
        warnings=data["warnings"],
        source=data["source"],
    )


def _pack_samples(samples: Samples, arrays: dict[str, np.ndarray]) -> dict[str, Any]:
    arrays["samples/points"] = samples.points
    arrays["samples/normals"] = samples.normals
    arrays["samples/radius"] = samples.radius
    names = sorted({name for name in samples.attached if name is not None})
    number = {name: i for i, name in enumerate(names)}
    arrays["samples/attached"] = np.array([number.get(name, -1) for name in samples.attached], np.int32)
    display = samples.display
    if display is not None:
        for name, value in vars(display).items():
            if isinstance(value, np.ndarray):
                arrays[f"display/{name}"] = value
    return {
        "attached": names,
        "grid_shape": samples.grid_shape,
        "spacing": samples.spacing,
        "display_spacing": None if display is None else display.spacing,
    }


def _unpack_samples(data: dict[str, Any], arrays: dict[str, np.ndarray]) -> Samples:
    names = np.array([*data["attached"], None], dtype=object)
    samples = Samples(
        arrays["samples/points"],
        arrays["samples/normals"],
        arrays["samples/radius"],
        names[arrays["samples/attached"]],
    )
    samples.grid_shape = None if data["grid_shape"] is None else tuple(data["grid_shape"])
    samples.spacing = data["spacing"]
    if data["display_spacing"] is not None:
        own = {
            name.removeprefix("display/"): array
            for name, array in arrays.items()
            if name.startswith("display/")
        }
        samples.display = DisplayMesh(**own, spacing=data["display_spacing"])
    return samples
