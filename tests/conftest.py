# SPDX-License-Identifier: Apache-2.0
"""What holds for all tests: the same examples in every run, and a cache of their own."""

from __future__ import annotations

import pytest
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
