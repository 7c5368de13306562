# SPDX-License-Identifier: Apache-2.0
"""Checks include rules of the core (docs/explanation/architecture.md, 1-4, 6, 7); no circles in the page."""

from __future__ import annotations

import posixpath
import re
import sys
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

STAGES = (
    "base",
    "lights",
    "surfaces",
    "scene",
    "trace",
    "direct",
    "segments",
    "samples",
    "estimate",
    "gather",
    "plan",
    "session",
)
ESTIMATORS = (
    "brute_force",
    "disc_index",
    "sphere_cache",
    "ray_map",
    "photon_map",
    "patch_sum",
    "local_linear",
)
# Rooms of a stage: each may include those before it; "" are the files beside them.
ROOMS = {
    "gather": ("cells", "aim", "hits", "choose"),
    "session": (
        "world",
        "paths",
        "discs",
        "direct",
        "cells",
        "rays",
        "images",
        "shared",
        "state",
        "flow",
        "bake",
        "update",
        "read",
        "file",
        "exchange",
        "",
    ),
}
# Third party -> the only file (without suffix) that may include it.
THIRD_PARTIES = {
    "embree": "trace/embree_scene",
    "tbb": "base/parallel",
    "oneapi": "base/parallel",
    "nanoflann": "estimate/photon_map/photon_map",
}
# The core neither prints, nor reads files, nor knows Python.
BANNED_HEADERS = {"cstdio", "stdio.h", "iostream", "fstream", "filesystem", "Python.h"}
PRINTS = "base/assertion"  # but for a false assertion
BANNED_CALLS = re.compile(r"\b(?:f?printf|puts|abort|exit)\s*\(|std::c(?:out|err)\b")
# Types that only their own stage and session/ may change.
OWNED = {"Scene": "scene", "SegmentStore": "segments", "SampleSet": "samples", "DiscSet": "samples"}

INCLUDE = re.compile(r'^\s*#\s*include\s*(["<])([^">]+)[">]', re.MULTILINE)
# An import of another module of the page, also of its types only.
PAGE_IMPORT = re.compile(r"""\b(?:from|import)\s*\(?\s*['"](\.[^'"]*)['"]""")
COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)


def estimator_of(below: str) -> str | None:
    """Return the estimator that a file of estimate/ belongs to, by folder or name; None for shared ones."""
    first, in_folder, _ = below.partition("/")
    if in_folder:
        return first if first in ESTIMATORS else None
    name = Path(first).stem
    return next((e for e in ESTIMATORS if name == e or name.startswith(e + "_")), None)


def check_own_include(where: str, target: str) -> str | None:
    """Return what is wrong when core/<where> includes the core header <target>, or None."""
    stage, _, below = where.partition("/")
    other, _, rest = target.partition("/")
    if other not in STAGES or not rest:
        return f'"{target}" is not of the form "<stage>/<header>.h"'
    if STAGES.index(other) > STAGES.index(stage):
        return f'"{target}" lies downstream: {stage} may include only {", ".join(stages_up_to(stage))}'
    if where == "plan/cost_model" and other != "base" and rest != "cost_model.h":
        return f'"{target}": the cost model runs without a scene and includes base only'
    if (rooms := ROOMS.get(stage)) and other == stage:
        room, theirs = posixpath.dirname(below), posixpath.dirname(rest)
        if room not in rooms or theirs not in rooms or rooms.index(theirs) > rooms.index(room):
            return f'"{target}": in {stage}, {room} may include only what stands before it in {rooms}'
    if stage == "estimate":
        if other in ("trace", "direct"):
            return f'"{target}": estimators see segments and samples only'
        mine, theirs = estimator_of(below), estimator_of(rest)
        if other == "estimate" and theirs and mine != theirs:
            return f'"{target}" is another estimator'
    return None


def stages_up_to(stage: str) -> tuple[str, ...]:
    """Return the stages that `stage` may include, itself last."""
    return STAGES[: STAGES.index(stage) + 1]


def check_foreign_include(where: str, target: str) -> str | None:
    """Return what is wrong when core/<where> includes the foreign header <target>, or None."""
    if target in BANNED_HEADERS and where != PRINTS:
        return f"<{target}>: the core does not print, read files or know Python"
    library = re.split(r"[/.]", target)[0]
    for name, owner in THIRD_PARTIES.items():
        if library.rstrip("34") == name and where not in (owner, f"{owner}_avx512"):
            return f"<{target}> belongs to core/{owner} alone"
    if library.startswith(("nanobind", "pybind11", "nlohmann", "rapidjson")):
        return f"<{target}>: the core knows neither bindings nor file formats"
    return None


def check_file(path: Path, core: Path) -> list[str]:
    """Return the violations of one file as "path:line: what"."""
    where = path.relative_to(core).with_suffix("").as_posix()
    stage, _, below = where.partition("/")
    if stage not in STAGES:
        return [f"{path}:1: core/{stage} is not a stage: use one of {', '.join(STAGES)}"]
    if stage == "estimate" and "/" in below and not estimator_of(below):
        return [f"{path}:1: core/{where.rpartition('/')[0]} is no estimator's folder: add it to ESTIMATORS"]
    text = path.read_text(encoding="utf-8")
    found: list[tuple[int, str]] = []
    for match in INCLUDE.finditer(text):
        check = check_own_include if match[1] == '"' else check_foreign_include
        if problem := check(where, match[2]):
            found.append((match.start(2), problem))
    code = COMMENT.sub(lambda m: re.sub(r"[^\n]", " ", m[0]), text)
    for match in () if where == PRINTS else BANNED_CALLS.finditer(code):
        found.append((match.start(), f"{match[0].rstrip('(')}: the core reports by exceptions and results"))
    for name, owner in OWNED.items():
        if stage in (owner, "session"):
            continue
        for match in re.finditer(rf"(?<!const )\b(?:\w+::)*{name}\s*[&*](?!&)", code):
            before = code[: match.start()]
            if not re.search(r"const\s+(?:\w+::)*$", before):
                found.append((match.start(), f"mutable {name}: only {owner} and session may change it"))
    return [f"{path}:{text.count(chr(10), 0, at) + 1}: {problem}" for at, problem in found]


def check_page(sources: Path) -> list[str]:
    """Return a circle of modules of the page that import each other as "path:1: what", if there is one."""
    imports: dict[str, list[str]] = {}
    for path in sources.rglob("*.ts"):
        name = path.relative_to(sources).with_suffix("").as_posix()
        folder = posixpath.dirname(name)
        targets = PAGE_IMPORT.findall(path.read_text(encoding="utf-8"))
        imports[name] = [posixpath.normpath(posixpath.join(folder, target)) for target in targets]
    try:
        TopologicalSorter(imports).prepare()
    except CycleError as error:
        circle = " -> ".join(reversed(error.args[1]))
        return [f"{sources / error.args[1][-1]}.ts:1: imports in a circle: {circle}"]
    return []


def main(root: Path) -> int:
    """Check the tree below `root`; return the exit code."""
    core = root / "core"
    files = sorted(p for p in core.rglob("*") if p.suffix in {".h", ".cpp"})
    problems = [line for path in files for line in check_file(path, core)]
    for name in ("tbb", "oneapi"):
        for path in sorted((root / "bindings").glob("*.cpp")):
            if re.search(rf"#\s*include\s*<{name}/", path.read_text(encoding="utf-8")):
                problems.append(f"{path}:1: <{name}/…> belongs to core/base/parallel alone")
    problems += check_page(root / "viewer" / "src")
    print("\n".join(problems) if problems else f"check_layers: {len(files)} files of core/ keep the rules")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main(Path(__file__).resolve().parent.parent))
