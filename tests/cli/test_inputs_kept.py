# SPDX-License-Identifier: Apache-2.0
"""No verb writes over a file that it reads, however the output's path is spelt."""

from __future__ import annotations

import base64
import json
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from builders.gltf import GltfBuilder
from PIL import Image

from .conftest import QUICK, Cli, Outcome

REFUSED = "which this command reads and writing would destroy; choose another name"


def plainly(file: Path, spelling: Path) -> Path:
    return file


def relatively(file: Path, spelling: Path) -> Path:
    return Path(os.path.relpath(file))


def through_its_folder(file: Path, spelling: Path) -> Path:
    (file.parent / "sub").mkdir()
    return file.parent / "sub" / ".." / file.name


def by_symbolic_link(file: Path, spelling: Path) -> Path:
    spelling.symlink_to(file)
    return spelling


def by_hard_link(file: Path, spelling: Path) -> Path:
    os.link(file, spelling)
    return spelling


Spell = Callable[[Path, Path], Path]
SPELLINGS = pytest.mark.parametrize(
    "spell", [plainly, relatively, through_its_folder, by_symbolic_link, by_hard_link]
)


def assert_refused(outcome: Outcome, kept: Path, before: bytes) -> None:
    assert outcome.code == 2, outcome.err
    assert REFUSED in outcome.error
    assert kept.read_bytes() == before


@pytest.fixture
def no_bake(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fails the test where light is computed."""

    def bake(*_: object, **__: object) -> None:
        raise AssertionError("the bake began")

    monkeypatch.setattr("deltalux.cli.commands.bake.bake_scene", bake)
    monkeypatch.setattr("deltalux.Session.update", bake)
    monkeypatch.setattr("deltalux.Session.recompute", bake)


@SPELLINGS
def test_bake_keeps_the_scene(cli: Cli, room: Path, tmp_path: Path, spell: Spell, no_bake: None) -> None:
    scene = Path(shutil.copy(room, tmp_path))
    before = scene.read_bytes()
    target = spell(scene, tmp_path / "lit.glb")
    assert_refused(cli("bake", scene, *QUICK, "-q", "-o", target), scene, before)


@SPELLINGS
def test_update_keeps_the_session(
    cli: Cli, session_file: Path, tmp_path: Path, spell: Spell, no_bake: None
) -> None:
    session = Path(shutil.copy(session_file, tmp_path))
    before = session.read_bytes()
    target = spell(session, tmp_path / "moved.dlx")
    outcome = cli("update", session, "--move", "MOVE_panel=1,0,-1", "-q", "-o", target)
    assert_refused(outcome, session, before)


def test_update_keeps_the_scene_of_the_session(cli: Cli, room: Path, tmp_path: Path) -> None:
    scene = Path(shutil.copy(room, tmp_path))
    before, session = scene.read_bytes(), tmp_path / "room.dlx"
    assert cli("bake", scene, *QUICK, "-q", "-o", session).code == 0
    assert_refused(cli("update", session, "-q", "-o", scene), scene, before)


@pytest.mark.parametrize("moved", [False, True])
@pytest.mark.parametrize("beside", [True, False])
def test_update_finds_the_scene_of_a_session_from_any_folder(
    cli: Cli, room: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, beside: bool, moved: bool
) -> None:
    """Beside its session it is known after both were moved; elsewhere after the session was."""
    names = ("scenes", "scenes") if beside else ("scenes", "sessions")
    scenes, sessions = (tmp_path / name for name in names)
    for folder in {scenes, sessions}:
        folder.mkdir()
    before = Path(shutil.copy(room, scenes)).read_bytes()
    monkeypatch.chdir(scenes)
    session = os.path.relpath(sessions / "room.dlx")
    assert cli("bake", room.name, *QUICK, "-q", "-o", session).code == 0
    monkeypatch.chdir(tmp_path)
    if moved:
        there = tmp_path / "there"
        sessions.rename(there)
        scenes, sessions = there if beside else scenes, there
    scene = scenes / room.name
    assert_refused(cli("update", sessions / "room.dlx", "-q", "-o", scene), scene, before)
    monkeypatch.chdir(sessions)
    assert_refused(cli("update", "room.dlx", "-q", "-o", os.path.relpath(scene)), scene, before)
    monkeypatch.chdir(tmp_path)
    outcome = cli("update", sessions / "room.dlx", "-q", "-o", room.name)  # another file of that name
    assert outcome.code == 0, outcome.err
    assert scene.read_bytes() == before


@pytest.fixture
def textured(tmp_path: Path) -> Path:
    """A .gltf whose textures lie beside it, one of them read by no one."""
    for name in ("oak.png", "the normals.png"):
        Image.new("RGB", (2, 2), (90, 60, 30)).save(tmp_path / name)
    builder = GltfBuilder()
    builder.node(name="floor", mesh=builder.quad(builder.material(name="oak")))
    path = builder.write(tmp_path, "room.gltf")
    document = json.loads(path.read_text())
    document["images"] = [{"uri": "oak.png"}, {"uri": "the%20normals.png"}]
    path.write_text(json.dumps(document))
    return path


@pytest.mark.parametrize("name", ["oak.png", "the normals.png"])
def test_bake_keeps_the_textures_of_a_gltf(cli: Cli, textured: Path, name: str, no_bake: None) -> None:
    texture = textured.with_name(name)
    assert_refused(cli("bake", textured, *QUICK, "-q", "-o", texture), texture, texture.read_bytes())


def test_bake_keeps_the_buffer_of_a_gltf(cli: Cli, textured: Path, no_bake: None) -> None:
    document = json.loads(textured.read_text())
    buffer = textured.with_name("room.npz")
    buffer.write_bytes(base64.b64decode(document["buffers"][0]["uri"].partition(",")[2]))
    document["buffers"][0]["uri"] = buffer.name
    textured.write_text(json.dumps(document))
    assert_refused(cli("bake", textured, *QUICK, "-q", "-o", buffer), buffer, buffer.read_bytes())


@pytest.mark.parametrize("name", ["room.mtl", "plank 1.png", "bumps.png"])
def test_bake_keeps_the_side_files_of_an_obj(cli: Cli, tmp_path: Path, name: str, no_bake: None) -> None:
    scene = tmp_path / "room.obj"
    scene.write_text("mtllib room.mtl\nv 0 0 0\nv 0 0 1\nv 1 0 0\nusemtl oak\nf 1 2 3\n")
    (tmp_path / "room.mtl").write_text("newmtl oak\nmap_Kd plank 1.png\nmap_Bump -bm 0.5 bumps.png\n")
    for picture in ("plank 1.png", "bumps.png"):
        Image.new("RGB", (2, 2)).save(tmp_path / picture)
    kept, link = tmp_path / name, tmp_path / "lit.png"
    link.symlink_to(kept)
    assert_refused(cli("bake", scene, *QUICK, "-q", "-o", link), kept, kept.read_bytes())


def test_compare_keeps_its_sessions(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    session = Path(shutil.copy(session_file, tmp_path))
    before, target = session.read_bytes(), by_symbolic_link(session, tmp_path / "difference.png")
    assert_refused(cli("compare", session_file, session, "-o", target), session, before)


def test_compare_methods_keeps_the_textures(cli: Cli, textured: Path) -> None:
    document = json.loads(textured.read_text())
    document["images"] = [{"uri": "whole.png"}]
    textured.write_text(json.dumps(document))
    texture = textured.with_name("oak.png").rename(textured.with_name("whole.png"))
    outcome = cli("compare-methods", textured, "--quick", "-q", "-o", textured.parent)
    assert_refused(outcome, texture, texture.read_bytes())


def test_one_file_spelt_twice_is_refused(cli: Cli, room: Path, tmp_path: Path) -> None:
    twice = tmp_path / "sub" / ".." / "lit.png"
    (tmp_path / "sub").mkdir()
    outcome = cli("bake", room, *QUICK, "-q", "-o", tmp_path / "lit.png", "-o", twice)
    assert outcome.code == 2
    assert "named twice; give every result a file of its own" in outcome.error
    assert not twice.exists()
