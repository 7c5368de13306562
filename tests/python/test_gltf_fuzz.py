# SPDX-License-Identifier: Apache-2.0
"""A short run of the glTF fuzz target, and proof that it notices what it looks for."""

import os
import time

import pytest
from fuzz import fuzz_gltf, mutate_gltf


@pytest.mark.timeout(300)
def test_a_few_hundred_mutated_files():
    report = fuzz_gltf.fuzz(seed=7, cases=500)
    assert report.failures == []
    assert report.cases == 500
    # Mutations that are all refused at the door, or all harmless, would test nothing.
    assert report.accepted > 25
    assert report.refused > 100
    assert len(report.messages) > 40


def test_cases_are_reproducible():
    valid = mutate_gltf.seeds()
    assert fuzz_gltf.make_case(3, 5, valid) == fuzz_gltf.make_case(3, 5, valid)
    assert fuzz_gltf.make_case(3, 5, valid) != fuzz_gltf.make_case(3, 6, valid)


def raising(error):
    def load(path, **options):
        raise error

    return load


@pytest.mark.parametrize(
    ("error", "outcome"),
    [
        (MemoryError(), "allocation storm"),
        (KeyError("x"), "uncaught exception"),
        (RecursionError(), "uncaught exception"),
    ],
)
def test_failures_are_noticed(tmp_path, monkeypatch, error, outcome):
    monkeypatch.setattr(fuzz_gltf.dl, "load", raising(error))
    assert fuzz_gltf.run_case(tmp_path, 1, 0, mutate_gltf.seeds())["outcome"] == outcome


def dying(pipe, seed):
    pipe.recv()
    os._exit(11)


def sleeping(pipe, seed):
    pipe.recv()
    time.sleep(60)


@pytest.mark.parametrize(("child", "outcome"), [(dying, "crash"), (sleeping, "hang")])
def test_dead_and_late_children_are_replaced(monkeypatch, child, outcome):
    monkeypatch.setattr(fuzz_gltf, "_child", child)
    monkeypatch.setattr(fuzz_gltf, "SECONDS_LIMIT", 2.0)
    report = fuzz_gltf.fuzz(seed=1, cases=2)
    assert [f["outcome"] for f in report.failures] == [outcome] * 2
