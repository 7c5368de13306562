# SPDX-License-Identifier: Apache-2.0
"""The house rules' own checks: each rule finds its violation, and nothing in a tree that keeps them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

TOOLS = Path(__file__).resolve().parents[2] / "tools"
HEADER = "// SPDX-License-Identifier: Apache-2.0\n// A file of the test.\n"


def run_tool(name: str, root: Path) -> tuple[int, str]:
    """Run a copy of the tool that believes `root` to be the project."""
    copy = root / "tools" / name
    copy.parent.mkdir(exist_ok=True)
    copy.write_text((TOOLS / name).read_text(encoding="utf-8"), encoding="utf-8")
    done = subprocess.run([sys.executable, copy], capture_output=True, text=True)
    return done.returncode, done.stdout + done.stderr


def layers(root: Path, file: str, text: str) -> tuple[int, str]:
    path = root / "core" / file
    path.parent.mkdir(parents=True)
    path.write_text(HEADER + text, encoding="utf-8")
    (root / "bindings").mkdir()
    return run_tool("check_layers.py", root)


@pytest.mark.parametrize(
    ("file", "text"),
    [
        ("scene/mesh.h", '#include "base/vec.h"\n#include <vector>\n'),
        (
            "estimate/disc_index/disc_index.cpp",
            '#include "estimate/crossing.h"\n#include "estimate/disc_index/tree.h"\n',
        ),
        (
            "estimate/patch_sum.cpp",
            '#include "estimate/crossing.h"\n#include "estimate/patch_sum_tree.h"\n',
        ),
        ("estimate/photon_map/photon_map.cpp", "#include <nanoflann.hpp>\n"),
        ("trace/embree_scene.cpp", "#include <embree3/rtcore.h>\n"),
        ("base/parallel.cpp", "#include <tbb/parallel_for.h>\n"),
        ("gather/aim/light.cpp", '#include "estimate/disc_index/tree.h"\n'),
        ("segments/light.cpp", '#include "direct/visibility.h"\n'),
        ("gather/hits/chain.h", '#include "gather/aim/guide.h"\n#include "gather/hits/vertex.h"\n'),
        ("session/session.cpp", '#include "session/world/world.h"\n#include "session/session_parts.h"\n'),
        ("estimate/read.cpp", "void f(const Scene& s, const scene::Scene& t, Scene&& u);\n"),
        ("base/text.cpp", "void f(); // printf(\n"),
    ],
)
def test_layers_accept(tmp_path: Path, file: str, text: str) -> None:
    code, out = layers(tmp_path, file, text)
    assert (code, out) == (0, "check_layers: 1 files of core/ keep the rules\n")


@pytest.mark.parametrize(
    ("file", "text", "found"),
    [
        ("scene/mesh.h", '#include "trace/walk.h"\n', "lies downstream"),
        ("samples/a.cpp", '#include "../base/vec.h"\n', "is not of the form"),
        ("elsewhere/a.cpp", "", "is not a stage"),
        ("direct/light.cpp", '#include "estimate/disc_index/tree.h"\n', "lies downstream"),
        ("estimate/ray_map/clip.h", '#include "trace/walk.h"\n', "see segments and samples only"),
        ("estimate/crossing.h", '#include "direct/block.h"\n', "see segments and samples only"),
        ("estimate/ray_map/clip.h", '#include "estimate/disc_index/tree.h"\n', "another estimator"),
        ("estimate/ray_map/clip.h", '#include "estimate/patch_sum_tree.h"\n', "another estimator"),
        ("estimate/patch_sum.cpp", '#include "estimate/ray_map/clip.h"\n', "another estimator"),
        ("estimate/wide_tree/tree.h", "", "no estimator's folder"),
        ("estimate/photon_map/area.cpp", "#include <nanoflann.hpp>\n", "photon_map/photon_map alone"),
        ("estimate/ray_map/photon_map.cpp", "#include <nanoflann.hpp>\n", "photon_map/photon_map alone"),
        ("plan/cost_model.cpp", '#include "scene/scene.h"\n', "includes base only"),
        ("gather/aim/guide.h", '#include "gather/hits/vertex.h"\n', "aim may include only"),
        ("gather/guide.h", '#include "gather/aim/beam.h"\n', "may include only"),
        ("session/read/light.h", '#include "session/session.h"\n', "read may include only"),
        ("trace/walk.cpp", "#include <embree4/rtcore.h>\n", "belongs to core/trace/embree_scene"),
        ("session/session.cpp", "#include <tbb/task_arena.h>\n", "belongs to core/base/parallel"),
        ("scene/a.cpp", "#include <nanobind/nanobind.h>\n", "neither bindings nor file formats"),
        ("scene/a.cpp", "#include <fstream>\n", "does not print, read files"),
        ("scene/a.cpp", 'void f() { printf("x"); }\n', "reports by exceptions"),
        ("estimate/a.cpp", "void f(scene::Scene& s);\n", "mutable Scene"),
        ("direct/a.cpp", "void f(SegmentStore* s);\n", "mutable SegmentStore"),
    ],
)
def test_layers_refuse(tmp_path: Path, file: str, text: str, found: str) -> None:
    code, out = layers(tmp_path, file, text)
    assert code == 1
    assert found in out
    assert f"{file}:" in out


def page(root: Path, **modules: str) -> tuple[int, str]:
    sources = root / "viewer" / "src"
    (sources / "three").mkdir(parents=True)
    for name, text in modules.items():
        (sources / (name.replace("_", "/") + ".ts")).write_text(text, encoding="utf-8")
    return run_tool("check_layers.py", root)


def test_layers_accept_a_page_without_circles(tmp_path: Path) -> None:
    code, out = page(
        tmp_path,
        three_scene="import { A } from '../a'\nimport { Mesh } from 'three'\n",
        a="import './a.css'\n",
    )
    assert code == 0, out


def test_layers_refuse_circles_of_the_page(tmp_path: Path) -> None:
    code, out = page(
        tmp_path,
        three_scene="import { A } from '../a'\n",
        a="import {\n  B,\n} from './b'\n",
        b="import type { Scene } from './three/scene'\n",
    )
    assert code == 1
    assert ".ts:1: imports in a circle: " in out
    circle = out.strip().split(": ")[-1].split(" -> ")[:-1]
    first = circle.index("a")
    assert circle[first:] + circle[:first] == ["a", "b", "three/scene"]


def text_check(root: Path, name: str, text: str) -> tuple[int, str]:
    subprocess.run(["git", "init", "-q", root], check=True)
    (root / name).write_text(text, encoding="utf-8")
    return run_tool("check_text.py", root)


def test_text_accepts(tmp_path: Path) -> None:
    code, out = text_check(tmp_path, "a.h", HEADER + "int a;  // see /usr/include and /tmp/x\n")
    assert code == 0, out


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("a.py", '"""No licence."""\n', "a.py:1: the licence line is missing"),
        ("a.h", "// SPDX-License-Identifier: Apache-2.0\n#pragma once\n", "a.h:2: line 2 must say"),
        ("a.h", HEADER + "int a; \n", "a.h:3: trailing white space"),
        ("a.md", "see /" + "home/someone/file\n", "is a path of one machine"),
        ("a.md", "TO" + "DO: write\n", "leftover"),
    ],
)
def test_text_refuses(tmp_path: Path, name: str, text: str, found: str) -> None:
    code, out = text_check(tmp_path, name, text)
    assert code == 1
    assert found in out


def functions(root: Path, name: str, text: str) -> tuple[int, str]:
    subprocess.run(["git", "init", "-q", root], check=True)
    (root / name).write_text(text, encoding="utf-8")
    return run_tool("check_functions.py", root)


LONG, SHORT = "  go();\n" * 61, "  go();\n" * 60
PYTHON_LONG = "    go()\n" * 61


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.cpp", f"void f() {{\n{SHORT}}}\n"),
        ("a.cpp", f"namespace a {{\nvoid f();\n{LONG}}}\n"),
        ("a.h", f"struct A {{\n  void f() {{}}\n{LONG}}};\n"),
        ("a.cpp", f"// long: a list of names.\nvoid f() {{\n{LONG}}}\n"),
        ("a.cpp", f"#if defined(A) && B(2)\nstruct S {{\n{LONG}}};\n#endif\n"),
        ("a.cpp", 'void f() { go("{"); } // {\n' + LONG),
        ("a.ts", f"export class A {{\n  f() {{\n    // long: a list of names\n{LONG}  }}\n}}\n"),
        ("a.py", 'def f():\n    """Go.\n\n' + "    On.\n" * 80 + '    """\n    go()\n'),
        ("a.py", f"# long: a list of names\ndef f():\n{PYTHON_LONG}"),
    ],
)
def test_functions_accept(tmp_path: Path, name: str, text: str) -> None:
    code, out = functions(tmp_path, name, text)
    assert code == 0, out


@pytest.mark.parametrize(
    ("name", "text", "found"),
    [
        ("a.cpp", f"namespace a {{\nint A::f(int x) const {{\n{LONG}}}\n}}\n", "a.cpp:2: A::f: 61 lines"),
        ("a.cpp", f"int f() {{\n{LONG}}}\n// long: too far away.\n", "a.cpp:1: f: 61 lines"),
        ("a.h", f"struct A {{\n  void f(int a,\n         int b) {{\n{LONG}  }}\n}};\n", "a.h:2: f: 61"),
        ("a.cpp", f"A::A(int a) : a_(a), b_{{2}} {{\n{LONG}}}\n", "a.cpp:1: A::A: 61"),
        ("a.ts", f"export function f(a: number): void {{\n{LONG}}}\n", "a.ts:1: f: 61 lines"),
        ("a.py", f"class A:\n    def f():\n{PYTHON_LONG.replace('    ', '        ')}", "a.py:2: f: 61 lines"),
    ],
)
def test_functions_refuse(tmp_path: Path, name: str, text: str, found: str) -> None:
    code, out = functions(tmp_path, name, text)
    assert code == 1
    assert found in out
