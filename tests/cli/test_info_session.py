# SPDX-License-Identifier: Apache-2.0
"""`deltalux info` of session files: what made them, what they hold, how they were edited."""

from __future__ import annotations

from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.gltf import GltfBuilder
from deltalux.stored.snapshot import VERSION
from session_files import rewrite

from .conftest import HALF_TURN_UP, QUICK, Cli


@pytest.fixture
def edited(cli: Cli, session_file: Path, tmp_path: Path) -> Path:
    """The room's session after edits of every kind but removal, which the second update does."""
    path = tmp_path / "edited.dlx"
    edits = ["--move", "MOVE_panel=1,0.5,0,90", "--dim", "lamp=0.25", "--reflectance", "oak=0.5,0.25,0.125"]
    assert cli("update", session_file, *edits, "-q", "-o", path).code == 0
    return path


def test_a_session_tells_what_it_holds(cli: Cli, session_file: Path, room: Path) -> None:
    facts = cli("info", session_file, "--json").data
    scene = cli("info", room, "--json").data
    session = facts.pop("session")
    assert facts == scene  # its scene is the room
    assert session["options"]["paths"] == 20000
    assert session["options"]["seed"] == 1
    assert session["baked"]
    with dl.Session.open(session_file) as opened:
        assert session["segments"] == opened.statistics["segments"]
        assert session["samples"]["count"] == len(opened.samples)
        assert session["samples"]["vertices"] == len(opened.samples.display.points)
    assert session["edits"] == {"moved": {}, "removed": [], "dimmed": {}, "reflectances": {}}
    names = [name for name, size in session["bytes"].items() if size]
    assert {"scene", "samples", "gather", "paths"} <= set(names)
    assert 0.95 < sum(session["bytes"].values()) / session_file.stat().st_size <= 1


def test_a_session_tells_its_edits(cli: Cli, edited: Path, tmp_path: Path) -> None:
    edits = cli("info", edited, "--json").data["session"]["edits"]
    motion = edits["moved"].pop("MOVE_panel")
    np.testing.assert_allclose(motion["offset"], (1, 0.5, 0), atol=1e-6)
    assert motion["degrees"] == pytest.approx(90)
    assert edits == {
        "moved": {},
        "removed": [],
        "dimmed": {"lamp": 0.25},
        "reflectances": {"oak": [0.5, 0.25, 0.125]},
    }
    again = tmp_path / "again.dlx"
    assert cli("update", edited, "--remove", "MOVE_panel", "--dim", "lamp=1", "-q", "-o", again).code == 0
    edits = cli("info", again, "--json").data["session"]["edits"]
    assert (edits["removed"], edits["dimmed"]) == (["MOVE_panel"], {})


def test_a_session_tells_the_commands_that_made_it(
    cli: Cli, session_file: Path, edited: Path, room: Path, tmp_path: Path
) -> None:
    bake, update = cli("info", edited, "--json").data["session"]["made_by"]
    assert bake == f"deltalux {dl.__version__}: deltalux bake {room} {' '.join(QUICK)} -q -o {session_file}"
    assert update.startswith(f"deltalux {dl.__version__}: deltalux update {session_file} --move MOVE_panel=1")
    copies = [tmp_path / "copy.dlx", tmp_path / "second.dlx"]
    with dl.Session.open(edited) as session:
        for copy in copies:
            session.save(copy)
    assert copies[0].read_bytes() == copies[1].read_bytes()
    with dl.Session.open(copies[1]) as session:
        assert session.made_by == (bake, update, f"deltalux {dl.__version__}: Session.save")


def test_the_tables_show_it(cli: Cli, edited: Path) -> None:
    out = cli("info", edited, "--nodes").out
    for text in ("deltalux update", "20,000, seed 1", "moved by 1, 0.5, 0 m, turned by 90°", "dimmed to 0.25",
                 "reflects 0.5, 0.25, 0.125", "size by part", "gather", "iB", "MOVE_panel"):  # fmt: skip
        assert text in out


def test_options_of_a_scene_are_refused(cli: Cli, session_file: Path) -> None:
    outcome = cli("info", session_file, "--unit", "cm")
    assert outcome.code == 2
    assert "--unit" in outcome.error


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda i: i.update(made_by="me"), r"index\.made_by: found 'me', expected a list of texts"),
        (lambda i: i.update(version=VERSION - 1), f"format {VERSION - 1}, this program reads {VERSION}"),
        (lambda i: i["scene"]["nodes"][0].update(lights=["no such"]), r"nodes\[0\]\.lights: found"),
        (lambda i: i["scene"]["meshes"].pop(), "found|fewer|without"),
    ],
)
def test_damage_is_told(cli: Cli, session_file: Path, tmp_path: Path, change, message: str) -> None:
    path = tmp_path / "damaged.dlx"
    path.write_bytes(session_file.read_bytes())
    rewrite(path, index=change)
    with pytest.raises(dl.FormatError, match=message):
        dl.Session.open(path)
    outcome = cli("info", path)
    assert outcome.code == 1
    assert str(path) in outcome.error


def test_only_the_last_commands_are_kept(session_file: Path, tmp_path: Path) -> None:
    path = tmp_path / "long.dlx"
    path.write_bytes(session_file.read_bytes())
    rewrite(path, index=lambda index: index.update(made_by=["x" * 9000] * 150))
    with dl.Session.open(path) as session:
        assert [len(line) for line in session.made_by] == [4000] * 100
        session.save(path, "the newest")
    with dl.Session.open(path) as session:
        assert len(session.made_by) == 100
        assert session.made_by[-1].endswith("the newest")


def test_dim_reaches_all_lamps_of_a_name_one_or_a_pattern(cli: Cli, tmp_path: Path) -> None:
    builder = GltfBuilder()
    grey = builder.material(name="grey", colour=(0.5, 0.5, 0.5))
    builder.node(name="floor", mesh=builder.quad(grey), rotation=HALF_TURN_UP, scale=[4, 4, 4])
    point = builder.light(type="point", intensity=100)
    for x in (1, 2, 3):
        builder.node(name="lamp", extensions=point, translation=[x, 2, -2])
    scene, session = builder.write(tmp_path), tmp_path / "a.dlx"
    bake = ("bake", scene, "--paths", "2000", "--gather", "off", "--spacing", "1", "-q", "-o", session)
    assert cli(*bake).code == 0
    for words, dimmed in {
        ("lamp=0.5",): {"lamp": 0.5, "lamp#2": 0.5, "lamp#3": 0.5},
        ("lamp#1=0.5",): {"lamp": 0.5},
        ("lamp#[23]=0.25",): {"lamp#2": 0.25, "lamp#3": 0.25},
        ("lamp=0", "lamp#2=1"): {"lamp": 0, "lamp#3": 0},
    }.items():
        edits = [part for word in words for part in ("--dim", word)]
        out = tmp_path / "b.dlx"
        assert cli("update", session, *edits, "-q", "-o", out).code == 0
        assert cli("info", out, "--json").data["session"]["edits"]["dimmed"] == dimmed
    assert 'dim "lump": no such light group' in cli("update", session, "--dim", "lump=1").error
    assert cli(*bake, "--groups", "name").code == 0
    with dl.Session.open(session) as opened:
        assert list(opened.dim_factors) == ["lamp"]
