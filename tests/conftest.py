# SPDX-License-Identifier: Apache-2.0
"""What holds for all tests: the same examples in every run, a cache of their own; and reports at once."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from deltalux import _core
from hypothesis import settings

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("new", deadline=None, print_blob=True)  # --hypothesis-profile=new: other examples
settings.load_profile("same")


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory):
    """Tests keep the machine busy: what they measure must not be what the user's planner reckons with."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("XDG_CACHE_HOME", str(tmp_path_factory.mktemp("cache")))
        yield


@pytest.fixture
def reports_at_once() -> Iterator[None]:
    """However short, every stage is told."""
    _core.set_report_seconds(0)
    yield
    _core.set_report_seconds(0.02)
