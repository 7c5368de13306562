# SPDX-License-Identifier: Apache-2.0
"""`deltalux update`: edits of a saved session."""

from __future__ import annotations

import hashlib
import shutil
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux.cli.edits import moved_pose
from deltalux.cli.options import Move
from deltalux.outputs import tables
from session_files import rewrite
from unknown_light import sconce_moves

from .conftest import QUICK, Cli


def test_moved_pose_shifts_in_world_space_and_turns_about_its_own_origin() -> None:
    pose = np.eye(4)
    pose[:3, 3] = (1, 2, 3)
    moved = moved_pose(pose, Move("chair", (0.5, 0, -1), 90))
    assert np.allclose(moved[:3, 3], (1.5, 2, 2))
    assert np.allclose(moved[:3, :3] @ (1, 0, 0), (0, 0, -1))  # +X turns to -Z, seen from above to the left
    assert np.array_equal(pose[:3, 3], (1, 2, 3))


def test_without_edits_nothing_changes(cli: Cli, session_file: Path) -> None:
    data = cli("update", session_file, "--json").data
    assert data["affected_paths"] == 0
    assert data["digest"] == cli("update", session_file, "--json").data["digest"]


def test_move_and_back_restores_every_bit(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    original = cli("update", session_file, "--json").data["digest"]
    moved = tmp_path / "moved.dlx"
    there = cli("update", session_file, "--move", "MOVE_panel=1.5,0,-1.5,90", "--json", "-o", moved).data
    assert there["digest"] != original
    assert 0 < there["affected_paths"] < there["paths"]
    back = cli("update", moved, "--move", "MOVE_panel=-1.5,0,1.5,-90", "--json").data
    assert back["affected_paths"] > 0
    # A quarter turn and back is not exact in floating point, so compare the light, not the bits.
    assert back["sets"][0]["mean"] == pytest.approx(
        cli("update", session_file, "--json").data["sets"][0]["mean"], rel=1e-3
    )


def test_a_bake_that_would_pay_is_told(cli: Cli, tmp_path: Path) -> None:
    scene, samples, _ = sconce_moves(np.array([4.2, 2.5, 3.4]))
    file = tmp_path / "room.dlx"
    with dl.Session(scene, samples, paths=20_000, gather=256, seed=7) as session:
        session.bake()
        session.save(file)
    told = "a bake of the scene as it is now may make the error up to"
    assert told not in " ".join(cli("update", file).out.split())
    move = ("--move", "sconce=-2.3,-0.25,3.3")  # to the wall on the other side
    assert told in " ".join(cli("update", file, *move).out.split())
    assert cli("update", file, *move, "--json").data["rebake_gain"] > 1.5
    assert cli("update", file, "--json").data["rebake_gain"] < 1.2


def test_shift_by_powers_of_two_and_back_restores_every_bit(
    cli: Cli, session_file: Path, tmp_path: Path
) -> None:
    original = cli("update", session_file, "--json").data["digest"]
    moved = tmp_path / "moved.dlx"
    there = cli("update", session_file, "--move", "MOVE_panel=1,0,-1", "--json", "-o", moved).data
    assert there["digest"] != original
    assert cli("update", moved, "--move", "MOVE_panel=-1,0,1", "--json").data["digest"] == original


def test_remove_and_add_restore_every_bit(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    original = cli("update", session_file, "--json").data["digest"]
    without = tmp_path / "without.dlx"
    data = cli("update", session_file, "--remove", "MOVE_panel", "--json", "-o", without).data
    assert [s["name"] for s in data["sets"]] == ["surfaces"]
    assert cli("update", without, "--add", "MOVE_panel", "--json").data["digest"] == original


def test_dim_scales_the_light(cli: Cli, session_file: Path) -> None:
    full = cli("update", session_file, "--json").data
    dim = cli("update", session_file, "--dim", "lamp=0.25", "--json").data
    assert dim["affected_paths"] == 0
    for before, after in zip(full["sets"], dim["sets"], strict=True):
        assert after["mean"] == pytest.approx(before["mean"] / 4, rel=1e-9)


def test_reflectance_changes_the_light(cli: Cli, session_file: Path) -> None:
    before = cli("update", session_file, "--json").data
    after = cli("update", session_file, "--reflectance", "grey=0.9", "--json").data
    assert after["digest"] != before["digest"]


def test_session_file_stays_as_it_is(cli: Cli, session_file: Path) -> None:
    before = hashlib.sha256(session_file.read_bytes()).digest()
    cli("update", session_file, "--move", "MOVE_panel=1,0,-1", "-q")
    assert hashlib.sha256(session_file.read_bytes()).digest() == before


def test_outputs_show_the_edited_state(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "moved.npz"
    outcome = cli("update", session_file, "--move", "MOVE_panel=1,0,-1", "-o", file, tmp_path / "moved.png")
    assert outcome.code == 0
    assert "paths traced again" in outcome.out
    assert tables.read(file).points[:, 0].max() <= 2.0
    assert (tmp_path / "moved.png").exists()


@pytest.mark.parametrize(
    ("edit", "text"),
    [
        (("--move", "sofa=1,0,0"), "sofa"),
        (("--move", "floor=1,0,0"), "static"),
        (("--add", "MOVE_panel"), "it is in the scene already"),
        (("--dim", "sun=1"), "no such light group"),
        (("--reflectance", "gold=1"), "gold"),
    ],
)
def test_impossible_edits_are_one_line(
    cli: Cli, session_file: Path, edit: tuple[str, str], text: str
) -> None:
    outcome = cli("update", session_file, *edit)
    assert outcome.code == 1
    assert text in outcome.error


@pytest.fixture
def foreign_file(session_file: Path, tmp_path: Path) -> Path:
    """The session, as if another build had written it."""
    path = Path(shutil.copy(session_file, tmp_path / "foreign.dlx"))
    rewrite(path, index=lambda index: index.update(built_by="another build"))
    return path


def test_a_session_of_another_build_is_recomputed_and_edited(
    cli: Cli, session_file: Path, foreign_file: Path, tmp_path: Path
) -> None:
    edit = ("--move", "MOVE_panel=1,0,-1")
    expected = cli("update", session_file, *edit, "--json").data
    assert (expected["recomputed"], expected["recomputed_because"]) == (False, None)
    outcome = cli("update", foreign_file, *edit, "--json", "-o", tmp_path / "moved.dlx")
    assert outcome.code == 0, outcome.err
    (line,) = outcome.err.splitlines()
    assert line.startswith(f"warning: {foreign_file}: its light was computed by another build or processor")
    assert "(another build; this is " in line
    assert line.endswith("everything is computed again before the first edit")
    assert outcome.data["recomputed"] is True
    assert line == f"warning: {outcome.data['recomputed_because']}"
    assert outcome.data["digest"] == expected["digest"]
    again = cli("update", tmp_path / "moved.dlx", "--json")
    assert (again.code, again.err, again.data["recomputed"]) == (0, "", False)


def test_a_session_of_another_build_quietly(cli: Cli, foreign_file: Path) -> None:
    outcome = cli("update", foreign_file, "-q")
    assert (outcome.code, outcome.out, outcome.err) == (0, "", "")


def test_truncated_session_is_refused(cli: Cli, session_file: Path, tmp_path: Path) -> None:
    half = tmp_path / "half.dlx"
    half.write_bytes(session_file.read_bytes()[:5000])
    outcome = cli("update", half)
    assert outcome.code == 1
    assert "half.dlx" in outcome.error


def test_lit_meshes_and_sessions_are_refined_where_shadows_lie_now(
    cli: Cli, room: Path, tmp_path: Path
) -> None:
    first, second, plain = (tmp_path / name for name in ("a.dlx", "b.dlx", "plain.dlx"))
    assert cli("bake", room, *QUICK, "-o", first, "--json").data["detail_vertices"] > 0
    assert cli("update", first, "--move", "MOVE_panel=0.5,0,-0.5", "-o", second).code == 0
    cli("bake", room, *QUICK, "--detail", "none", "-o", plain)
    assert (
        cli("update", plain, "--dim", "lamp=0.5", "-o", tmp_path / "c.dlx", "--json").data["detail"] is None
    )
    with dl.Session.open(first) as old, dl.Session.open(second) as new:
        places = [session.samples.display.points for session in (old, new)]
        assert not np.array_equal(*places)
        old.move("MOVE_panel", new.pose("MOVE_panel"))
        old.refine()
        np.testing.assert_array_equal(old.samples.display.points, places[1])
