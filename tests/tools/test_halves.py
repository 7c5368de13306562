# SPDX-License-Identifier: Apache-2.0
"""Each slow test is in one of two halves, with all of its file."""

from __future__ import annotations

import pytest
import thoroughness
from thoroughness import in_other_half

FILES = [f"tests/python/test_{i}.py" for i in range(200)]


def test_each_half_leaves_out_what_the_other_runs(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(thoroughness, "HALF", "")
    assert not any(in_other_half(file) for file in FILES)
    left_out = []
    for half in ("190fb97", "190fb98"):
        monkeypatch.setattr(thoroughness, "HALF", half)
        left_out.append({file for file in FILES if in_other_half(f"{file}::test_one[2-x]")})
        assert left_out[-1] == {file for file in FILES if in_other_half(f"{file}::test_two")}
    assert left_out[0].isdisjoint(left_out[1]) and left_out[0] | left_out[1] == set(FILES)
    assert 60 < len(left_out[0]) < 140
