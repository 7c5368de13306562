# SPDX-License-Identifier: Apache-2.0
"""The Python of every page runs, block after block, as a reader would type it; on less light, to be quick."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import deltalux as dl
import pytest
from builders.gltf import GltfBuilder
from deltalux import session_options
from deltalux.samples import samples
from deltalux.scene import replace_scene

from docs.pages import DOCUMENTS, blocks, name_of, text_of

LANGUAGES = {"", "cpp", "python", "sh"}  # another name for one of these would escape the tests
HALF_TURN_UP = [-(0.5**0.5), 0, 0, 0.5**0.5]  # turns +Z, where builder quads look, to +Y
FEW = 20  # triangles of a mesh
COARSE = 2.0  # metres


def run_page(name: str, text: str) -> dict[str, Any]:
    """Run the Python blocks of a page in one namespace; errors show the page's lines."""
    names: dict[str, Any] = {"__name__": "__main__"}
    for block in blocks(text):
        if block.language == "python":
            exec(compile("\n" * (block.line - 1) + block.text, name, "exec"), names)
    return names


PAGES = [path for path in DOCUMENTS if any(b.language == "python" for b in blocks(text_of(path)))]


def thinned(mesh: dl.Mesh) -> dl.Mesh:
    every = -(-len(mesh.triangles) // FEW)
    index = mesh.material_index[::every]
    return replace(mesh, triangles=mesh.triangles[::every], material_index=index)


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Few paths, rays, triangles and samples; the reader's room.glb, which has a chair."""
    office = dl.scenes.office()
    few = replace_scene(office, meshes=[thinned(mesh) for mesh in office.meshes])
    assert few.groups == office.groups
    monkeypatch.setattr(dl.scenes, "office", lambda: few)
    monkeypatch.setattr(session_options, "default_paths", lambda gather: 2000)
    monkeypatch.setattr(session_options, "RAYS", {16: 1 << 30})
    refine = samples.refine
    monkeypatch.setattr(
        samples, "refine", lambda scene, spacing, **options: refine(scene, spacing or COARSE, **options)
    )
    monkeypatch.setattr("webbrowser.open", lambda url: True)
    monkeypatch.chdir(tmp_path)
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    floor = {"rotation": HALF_TURN_UP, "translation": [0, 0, 4], "scale": [5, 5, 5]}
    builder.node(name="floor", mesh=builder.quad(grey), **floor)
    builder.node(name="chair", mesh=builder.quad(grey), rotation=HALF_TURN_UP, translation=[1, 0.5, 2])
    lamp = builder.light(name="lamp", type="point", intensity=400.0)
    builder.node(name="lamp", translation=[2, 2, 2], extensions=lamp)
    builder.write(tmp_path, "room.glb")


def test_there_is_something_to_check() -> None:
    assert len(PAGES) >= 8


@pytest.mark.parametrize("path", PAGES, ids=name_of)
def test_python_of_page_runs(path: Path) -> None:
    run_page(name_of(path), text_of(path))


@pytest.mark.parametrize("path", DOCUMENTS, ids=name_of)
def test_languages_of_blocks_are_known(path: Path) -> None:
    assert {block.language for block in blocks(text_of(path))} <= LANGUAGES


def test_blocks_of_a_page_share_names_and_errors_show_its_lines() -> None:
    assert run_page("p.md", "```python\na = 1\n```\ntext\n```python\nb = a + 1\n```\n")["b"] == 2
    with pytest.raises(AttributeError, match="sessions") as error:
        run_page("p.md", "one\n\n```python\nimport deltalux as dl\n\ndl.sessions\n```\n")
    assert (error.traceback[-1].frame.code.raw.co_filename, error.traceback[-1].lineno) == ("p.md", 5)
