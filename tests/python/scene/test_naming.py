# SPDX-License-Identifier: Apache-2.0
"""Names that users type: what they mean, and what is shown where they mean nothing."""

from __future__ import annotations

import pytest
from deltalux.scene.naming import candidates, chosen, meant_by

NAMES = ["lamp", "lamp#2", "lamp#10", "lamp#two", "lamps", "desk [1]"]


@pytest.mark.parametrize(
    ("word", "meant"),
    [
        ("lamp", ["lamp", "lamp#2", "lamp#10"]),
        ("lamp#1", ["lamp"]),
        ("lamp#2", ["lamp#2"]),
        ("lamp*", ["lamp", "lamp#2", "lamp#10", "lamp#two", "lamps"]),
        ("desk [1]", ["desk [1]"]),
        ("chair", ["chair"]),
        ("chair#1", ["chair#1"]),
    ],
)
def test_a_word_means_all_that_bear_the_name(word: str, meant: list[str]) -> None:
    assert meant_by(word, NAMES) == meant


def test_a_name_comes_before_what_it_describes() -> None:
    assert chosen("a[b]", ["ab", "a[b]"]) == ["a[b]"]
    assert chosen("a[b]", ["ab"]) == ["ab"]


def test_candidates_are_the_nearest_then_those_that_hold_the_word_then_others() -> None:
    names = [f"mesh {i}" for i in range(30)] + ["ceiling lamp", "chair"]
    assert candidates("chairs", names).startswith("chair, mesh 0, ")
    assert candidates("LAMP", names).startswith("ceiling lamp, mesh 0, ")
    assert candidates("chairs", names).endswith(" and 16 more")
    assert candidates("x", []) == ""
