# SPDX-License-Identifier: Apache-2.0
"""The frame of the study: settings, keys, records, statistics of repetitions, drawings, the page."""

from __future__ import annotations

import dataclasses
import sys
import xml.etree.ElementTree as ET
from io import BytesIO

import numpy as np
import pytest
from deltalux.errors import Cancelled, FormatError, OptionError
from deltalux.studies.experiment import Curve, Experiment, Figure, Findings, Mark, Table, Verdict
from deltalux.studies.experiments import EXPERIMENTS, experiment
from deltalux.studies.progress_parts import Steps
from deltalux.studies.record import Record, from_json, to_json
from deltalux.studies.repeats import certain_sign, mean_and_error, outcome_of, together
from deltalux.studies.report.drawing import draw
from deltalux.studies.report.study_page import study_page
from deltalux.studies.report.study_tables import table_csv
from deltalux.studies.ripple import halving_period, peaks, ripple
from deltalux.studies.runner import run, run_key, settings_of
from PIL import Image

FIGURE = Figure(
    "shape",
    "A caption with <angles> & more.",
    "level $i$",
    "misses",
    [
        Curve("measured", [1, 2, 3], [10, 30, 20], [1, 2, 1]),
        Curve("theory", [1, 2, 3], [11, 28, 21], None, "theory"),
        Curve("bars", [1, 2, 3], [5, 6, 7], [1, 1, 1], "bars"),
    ],
    marks=[Mark(2, "peak")],
    log_y=True,
)
FINDINGS = Findings(
    [Table("numbers", ("a", "b [m]", "good"), [[1, 2.5, True], ["x, y", None, False]])],
    [FIGURE],
    [Verdict("Water is wet.", "confirmed", "It is."), Verdict("1 < 0", "refuted", "1 > 0.")],
    ["A note."],
)


def small(findings: Findings = FINDINGS) -> Experiment:
    return Experiment(
        "small",
        "A small one",
        "section 0",
        "Is it?",
        lambda settings, progress: findings,
        {"seeds": [1, 2], "size": 9, "shape": None},
        {"size": 3},
    )


def test_experiments_are_registered_under_their_modules_names() -> None:
    names = [each.name for each in EXPERIMENTS]
    assert len(set(names)) == len(names)
    for each in EXPERIMENTS:
        assert each.run.__module__.endswith("." + each.name.replace("-", "_"))
        assert each.full["seeds"]
        assert set(each.quick) <= set(each.full)
        assert "threads" not in each.full  # the runner's
        assert each.title and each.source and each.question


def test_unknown_experiment_is_explained() -> None:
    assert experiment("mean-rays").name == "mean-rays"
    with pytest.raises(OptionError, match=r"found 'mean-ray', expected .*; did you mean mean-rays\?"):
        experiment("mean-ray")


def test_settings_are_merged() -> None:
    assert settings_of(small()) == {"seeds": [1, 2], "size": 9, "shape": None, "threads": None}
    chosen = settings_of(small(), quick=True, seeds=[7, 5, 7], threads=2)
    assert chosen == {"seeds": [7, 5], "size": 3, "shape": None, "threads": 2}
    with pytest.raises(OptionError, match="seed: found -1"):
        settings_of(small(), seeds=[-1])


def test_key_follows_from_what_decides_the_findings() -> None:
    full = settings_of(small())
    assert run_key(small(), full) == run_key(small(), full | {"threads": 1})
    assert run_key(small(), full) != run_key(small(), full | {"size": 10})
    assert run_key(small(), full) != run_key(experiment("mean-rays"), full)  # another source


def test_record_returns_from_json_unchanged() -> None:
    record = run(small(), settings_of(small()))
    again = from_json(to_json(record))
    assert again == dataclasses.replace(record, seconds=again.seconds, findings=again.findings)
    assert again.seconds == record.seconds
    assert to_json(again) == to_json(record)
    assert again.findings.figures[0].curves[2].style == "bars"
    assert record.environment["processor"]


def test_numpy_values_become_json_and_nan_is_refused() -> None:
    def holding(value: object) -> Record:
        findings = dataclasses.replace(FINDINGS, tables=[Table("t", ("a",), [[value]])])  # type: ignore[list-item]
        return run(small(findings), settings_of(small()))

    assert from_json(to_json(holding(np.int64(3)))).findings.tables[0].rows == [[3]]
    with pytest.raises(ValueError, match="JSON"):
        to_json(holding(np.nan))


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"name": "a", "findings": {}}', "\0"])
def test_foreign_record_is_refused(text: str) -> None:
    with pytest.raises(FormatError, match="no record of an experiment"):
        from_json(text)


def test_certain_sign_errs_as_rarely_as_it_says() -> None:
    """Null hypothesis: a mean of 0 is given a sign with probability 0.01; 20,000 trials of 4 values.

    The count of false alarms is binomial, 200 ± 14; it lies within 5 sigmas but once in 1.7 million.
    """
    random = np.random.default_rng(5)
    values = random.normal(size=(20_000, 4))
    alarms = sum(certain_sign(row, 0.01) != 0 for row in values)
    assert abs(alarms - 200) < 70
    assert all(certain_sign(row / 100 - 5) == -1 for row in values[:50])


def test_single_repetition_decides_nothing() -> None:
    assert certain_sign([3.0]) == 0
    assert mean_and_error([[1.0, 2.0]]) == ([1.0, 2.0], None)
    mean, error = mean_and_error([[1.0, 2.0], [3.0, 2.0]])
    assert (mean, error) == ([2.0, 2.0], [1.0, 0.0])


def test_outcomes() -> None:
    assert [outcome_of(sign, wanted=-1) for sign in (-1, 0, 1)] == ["confirmed", "open", "refuted"]
    assert together(["confirmed", "confirmed"]) == "confirmed"
    assert together(["confirmed", "open"]) == "open"
    assert together(["open", "refuted"]) == "refuted"
    assert together([]) == "open"


def test_ripple_is_found_where_it_is() -> None:
    period = halving_period(0.9)
    assert period == pytest.approx(6.5788, abs=1e-4)
    levels = np.arange(3, 44)
    for shift in (0.0, 2.0, -1.5):
        wave = 0.2 * np.cos(2 * np.pi * (levels - shift) / period)
        found = ripple(levels, np.exp(0.2 * levels + wave), period)
        assert found.amplitude == pytest.approx(0.2, rel=0.05)
        assert found.offset == pytest.approx(shift, abs=0.15)
    assert ripple(levels, np.exp(0.2 * levels), period).amplitude < 1e-9
    assert peaks(np.arange(4, 9), np.array([1, 3, 2, 2, 5])) == [5]


def test_steps_report_and_stop() -> None:
    told: list[float] = []
    steps = Steps(lambda _, fraction: told.append(fraction), 4)
    for _ in range(4):
        steps.done()
    assert told == [0.25, 0.5, 0.75, 1.0]
    with pytest.raises(Cancelled):
        Steps(lambda *_: False, 4).done()


def test_drawing_is_repeatable_and_shows_everything() -> None:
    drawn = draw(FIGURE)
    assert draw(FIGURE) == drawn
    assert ET.fromstring(drawn.svg).tag.endswith("svg")
    pixels = np.asarray(Image.open(BytesIO(drawn.png)).convert("RGB"), dtype=int)
    assert pixels.shape[1] > 900
    for colour in ((0x00, 0x72, 0xB2), (0xD5, 0x5E, 0x00), (0x00, 0x9E, 0x73)):
        assert (np.abs(pixels - colour).sum(axis=2) < 12).sum() > 50
    without = dataclasses.replace(FIGURE, curves=FIGURE.curves[:2], marks=())
    assert draw(without).png != drawn.png


def test_missing_matplotlib_names_the_remedy(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    with pytest.raises(OptionError, match=r"found no matplotlib, .*pip install 'deltalux\[study\]'"):
        draw(FIGURE)


def test_table_as_csv() -> None:
    assert table_csv(FINDINGS.tables[0]) == 'a,b [m],good\n1,2.5,True\n"x, y",,False\n'


def test_page_holds_everything(tmp_path) -> None:
    record = run(small(), settings_of(small(), quick=True))
    file = tmp_path / "shape.svg"
    file.write_text(draw(FIGURE).svg, encoding="utf-8")
    page = study_page([(small(), record, {"shape": file})], "deltalux study small -o x", "Quick.")
    for text in (
        '<a href="#small">A small one</a>',
        '<a href="#small">small</a>',
        'id="small"',
        "Is it?",
        "2 claims: 1 confirmed, 1 refuted, 0 open.",
        "seeds 1/2",
        "size 3",
        "A note.",
    ):
        assert text in page
    for text in (
        "Water is wet.",
        "1 &lt; 0",
        "&lt;angles&gt; &amp; more",
        "Quick.",
        "deltalux study small -o x",
    ):
        assert text in page
    assert page.count("data:image/svg+xml;base64,") == 1
    assert 'download="numbers.csv"' in page
    assert "http" not in page.replace("http-equiv", "")
