# SPDX-License-Identifier: Apache-2.0
"""What is declared once is in the signature, in the docstring, in the file, and in the core."""

from __future__ import annotations

import inspect
import json

import deltalux as dl
import numpy as np
import pytest
from deltalux import core_session
from deltalux.session_options import OPTIONS, PlanOptions, SessionOptions, core_options, options_of
from rooms import room, samples_in

OWN_OF_PLAN = ["policy", "frames", "rebuild", "progress"]


def shown(taker) -> dict[str, inspect.Parameter]:
    return dict(inspect.signature(taker).parameters)


@pytest.mark.parametrize(
    "taker, declaration, own",
    [(dl.Session, SessionOptions, ["progress"]), (dl.plan, PlanOptions, OWN_OF_PLAN)],
)
def test_signatures_show_the_declared_options(taker, declaration, own):
    declared, parameters = options_of(declaration), shown(taker)
    assert list(parameters) == ["scene", "samples", *declared, *own]
    for name, option in declared.items():
        assert parameters[name].kind is inspect.Parameter.KEYWORD_ONLY
        assert parameters[name].default == option.default
        assert f"{name}: " in str(parameters[name])


def test_docstrings_have_an_entry_for_each_option():
    entries = inspect.getdoc(dl.Session)
    for name, option in OPTIONS.items():
        assert f"\n{name} : {option.help}\n" in entries
    assert ", ".join(options_of(PlanOptions)) in inspect.getdoc(dl.plan)
    assert "{" not in entries + inspect.getdoc(dl.plan)


def test_unknown_names_are_refused_as_by_any_call():
    scene = room()
    with pytest.raises(TypeError, match="unexpected keyword argument 'path'"):
        dl.Session(scene, path=1000)
    with pytest.raises(TypeError, match="unexpected keyword argument 'memory_limit'"):
        dl.plan(scene, memory_limit=1 << 30)
    with pytest.raises(TypeError, match="missing a required argument: 'scene'"):
        dl.Session(paths=1000)


def test_defaults_and_numpy_integers_can_be_stored():
    scene = room()
    samples = samples_in(scene)
    with dl.Session(scene, samples) as plain:
        assert plain.options == {name: option.default for name, option in OPTIONS.items()} | {
            "paths": 300_000,
            "gather": 1536,
        }
    counts = {"paths": 4096, "seed": 3, "threads": 1, "max_bounces": 9, "gather": 16}
    with dl.Session(scene, samples, **{name: np.int64(n) for name, n in counts.items()}) as session:
        assert json.loads(json.dumps(session.options)).items() >= counts.items()


@pytest.mark.parametrize(
    "change, problem",
    [
        ({"colour": 1}, 'found the option "colour", expected those of the core'),
        ({"seed": None}, "seed: found a value of another type"),
        ({"segment_end": 3}, "segment_end: found a value of another type"),
    ],
)
def test_the_core_refuses_what_it_does_not_have(monkeypatch, change, problem):
    monkeypatch.setattr(core_session, "core_options", lambda options: core_options(options) | change)
    with pytest.raises((dl.OptionError, TypeError), match=problem):
        dl.Session(room(), dl.Samples([(0, 0, 0)], [(0, 1, 0)]))


@pytest.mark.parametrize("name", OPTIONS)
def test_the_core_wants_each_option(monkeypatch, name):
    def without(options):
        return {key: value for key, value in core_options(options).items() if key != name}

    monkeypatch.setattr(core_session, "core_options", without)
    with pytest.raises(dl.OptionError, match=f'found no option "{name}"'):
        dl.Session(room(), dl.Samples([(0, 0, 0)], [(0, 1, 0)]))
