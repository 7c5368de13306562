# SPDX-License-Identifier: Apache-2.0
"""`deltalux study`: every experiment in a quick form, going on after an end, and errors before the work."""

from __future__ import annotations

import csv
import dataclasses
import json
import subprocess
from pathlib import Path
from typing import Any

import pytest
from deltalux.cli import run
from deltalux.cli.commands import study
from deltalux.cli.commands.study import PAGE
from deltalux.cli.commands.study_folder import RECORD
from deltalux.studies.experiment import Experiment
from deltalux.studies.experiments import EXPERIMENTS
from processes import interrupt_after, listen_to_interrupts
from thoroughness import slow

from .conftest import Cli
from .test_process import PROGRAM

FAST = "cache-misses"  # an experiment that takes less than a second
SOME = (FAST, "radius-ratio")


@dataclasses.dataclass(frozen=True)
class Studied:
    """Folder and --json of one quick run of some experiments."""

    experiments: tuple[Experiment, ...]
    folder: Path
    data: dict[str, Any]


@pytest.fixture(scope="module", params=["some", slow("all")])
def studied(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Studied:
    chosen = tuple(each for each in EXPERIMENTS if request.param == "all" or each.name in SOME)
    folder = tmp_path_factory.mktemp("study") / "new" / "folder"
    printed = folder.parent.parent / "printed.json"
    with pytest.MonkeyPatch.context() as patch, printed.open("w") as stream:
        patch.setattr(study, "EXPERIMENTS", chosen)
        patch.setattr("sys.stdout", stream)
        assert run(["study", "all", "--quick", "--json", "-o", str(folder)]) == 0
    return Studied(chosen, folder, json.loads(printed.read_text()))


def test_every_experiment_runs_and_says_something(studied: Studied) -> None:
    data = studied.data
    assert [each["name"] for each in data["experiments"]] == [each.name for each in studied.experiments]
    assert data["skipped"] == []
    for each in data["experiments"]:
        assert each["verdicts"]
        assert all(v["outcome"] in ("confirmed", "refuted", "open") and v["text"] for v in each["verdicts"])
        made = {path.suffix for path in (studied.folder / each["name"]).iterdir()}
        assert made == {".svg", ".png", ".csv", ".json"}


def test_page_is_complete_and_self_contained(studied: Studied) -> None:
    folder = studied.folder
    page = (folder / PAGE).read_text(encoding="utf-8")
    assert page.count("data:image/svg+xml;base64,") == len(list(folder.glob("*/*.svg")))
    assert page.count("data:text/csv;base64,") == len(list(folder.glob("*/*.csv")))
    assert 'src="http' not in page
    assert "A quick look" in page
    assert all(f'id="{each.name}"' in page for each in studied.experiments)
    assert ">nan<" not in page


def test_figures_have_axes_and_tables_parse(studied: Studied) -> None:
    folder = studied.folder
    for each in studied.data["experiments"]:
        record = json.loads((folder / each["name"] / RECORD).read_text())
        for figure in record["findings"]["figures"]:
            assert figure["x_label"] and figure["y_label"] and figure["caption"]
            assert any(curve["error"] for curve in figure["curves"]), figure["name"]
        for table in record["findings"]["tables"]:
            with (folder / each["name"] / f"{table['name']}.csv").open(newline="") as file:
                assert len(list(csv.DictReader(file))) == len(table["rows"]) > 0


def test_finished_experiments_are_skipped_unless_changed(cli: Cli, studied: Studied) -> None:
    folder = studied.folder
    words = ("study", FAST, "--quick", "-o", folder, "--json")
    record = folder / FAST / RECORD
    before = record.read_bytes()
    assert cli(*words).data["skipped"] == [FAST]
    assert cli(*words, "--threads", "1").data["skipped"] == [FAST]
    assert record.read_bytes() == before
    figure = next((folder / FAST).glob("*.svg"))
    figure.unlink()
    assert cli(*words).data["skipped"] == [FAST]
    assert figure.is_file()  # drawn again
    assert cli(*words, "--again").data["skipped"] == []
    outcome = cli(*words, "--seed", "5", "-s", "6")
    assert outcome.data["skipped"] == []
    assert outcome.data["experiments"][0]["settings"]["seeds"] == [5, 6]
    assert cli(*words).data["skipped"] == []  # the first seeds again


def test_counts_do_not_depend_on_threads(cli: Cli, tmp_path: Path) -> None:
    found = []
    for threads in ("1", "2"):
        assert cli("study", FAST, "--quick", "-q", "-o", tmp_path / threads, "--threads", threads).code == 0
        found.append(json.loads((tmp_path / threads / FAST / RECORD).read_text())["findings"])
    assert found[0] == found[1]


def test_broken_record_is_replaced(cli: Cli, tmp_path: Path) -> None:
    words = ("study", FAST, "--quick", "-q", "-o", tmp_path)
    (tmp_path / FAST).mkdir()
    (tmp_path / FAST / RECORD).write_text('{"name": ')
    (tmp_path / FAST / "old.svg").write_text("")
    assert cli(*words).code == 0
    assert json.loads((tmp_path / FAST / RECORD).read_text())["name"] == FAST
    assert not (tmp_path / FAST / "old.svg").exists()


def test_interrupted_study_keeps_what_is_finished(
    cli: Cli, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def interrupted(*_: Any) -> Any:
        raise KeyboardInterrupt

    fast = next(each for each in EXPERIMENTS if each.name == FAST)
    second = dataclasses.replace(EXPERIMENTS[0], run=interrupted)
    monkeypatch.setattr(study, "EXPERIMENTS", (fast, second))
    words = ("study", "all", "--quick", "-o", tmp_path)
    outcome = cli(*words)
    assert (outcome.code, outcome.error) == (130, "error: cancelled")
    assert [path.name for path in tmp_path.iterdir()] == [FAST]
    assert list((tmp_path / FAST).glob("*.svg"))  # drawn as soon as it ended
    monkeypatch.setattr(study, "EXPERIMENTS", (fast,))
    outcome = cli(*words)
    assert outcome.code == 0
    assert "finished before, not repeated" in outcome.out


def test_interrupt_stops_a_long_experiment_soon(tmp_path: Path) -> None:
    with subprocess.Popen(
        [*PROGRAM, "study", "curve-orders", "-o", tmp_path],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=listen_to_interrupts,
    ) as process:
        out, err, still_taken = interrupt_after(process, 4)  # libraries, and some of the experiment
    assert (process.returncode, out, err) == (130, "", "error: cancelled\n")
    assert still_taken < 5.0
    assert list(tmp_path.iterdir()) == []


def test_list_names_every_experiment(cli: Cli) -> None:
    outcome = cli("study", "--list")
    assert outcome.code == 0
    assert all(each.name in outcome.out for each in EXPERIMENTS)
    listed = cli("study", "--list", "--json").data["experiments"]
    assert [each["name"] for each in listed] == [each.name for each in EXPERIMENTS]


def test_a_file_in_the_folders_place_is_left_alone(cli: Cli, tmp_path: Path) -> None:
    place = tmp_path / "notes"
    place.write_text("mine")
    outcome = cli("study", "radius-ratio", "--quick", "-o", str(place))
    assert outcome.code == 1
    assert outcome.error.endswith("a file stands where a folder is expected; choose another name")
    assert place.read_text() == "mine"


def test_unknown_experiment_leaves_no_folder(cli: Cli, tmp_path: Path) -> None:
    outcome = cli("study", "curve-order", "-o", tmp_path / "out")
    assert outcome.code == 1
    assert "did you mean curve-orders?" in outcome.error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("words", "text"),
    [
        (("-o", "x"), "expected 'all' or a name of --list"),
        ((FAST,), "'-o'"),
        ((FAST, "-o", "x", "--seed", "-1"), "--seed"),
        ((FAST, "-o", "x", "--threads", "0"), "--threads"),
    ],
)
def test_wrong_usage(cli: Cli, words: tuple[str, ...], text: str) -> None:
    outcome = cli("study", *words)
    assert outcome.code == 2
    assert text in outcome.error
