# SPDX-License-Identifier: Apache-2.0
"""No method without a contract: every estimator is in a list that the contract suite runs over."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import deltalux as dl

from contract.methods import DISC_METHODS, GATHER_METHODS, SURFACE_METHODS

ROOT = Path(__file__).parents[2]


def is_estimator(function) -> bool:
    """Takes segments first, as all estimators and nothing else of `dl.estimate` do."""
    return inspect.isfunction(function) and next(iter(inspect.signature(function).parameters)) == "segments"


def test_every_estimator_of_the_package_is_under_contract():
    offered = {name for name in dl.estimate.__all__ if is_estimator(getattr(dl.estimate, name))}
    functions = [getattr(method, "func", method) for method in DISC_METHODS]
    functions += [method.function for method in (*GATHER_METHODS, *SURFACE_METHODS)]
    assert offered == {function.__name__ for function in functions}
    assert len(offered) >= 7


def test_every_signed_estimator_of_the_core_is_under_contract():
    """By name, in the C++ half of the suite: the package does not show all of them with a sign."""
    headers = sorted((ROOT / "core/estimate").rglob("*.h"))
    classes = [
        name
        for header in headers
        for name in re.findall(r"class (\w+)[^{;]*:\s*public SignedEstimator\b", header.read_text())
    ]
    assert len(classes) >= 4
    suite = (ROOT / "tests/core/signed_methods_test.cpp").read_text()
    listed = suite[suite.index("kMethods[] =") : suite.index("void PrintTo")]
    built = set(re.findall(r"make_unique<(\w+)>", suite))
    for name in classes:
        assert name in built, f"{name} has no entry in kMethods"
    assert listed.count('{"') >= len(classes)
