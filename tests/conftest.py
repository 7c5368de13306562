# SPDX-License-Identifier: Apache-2.0
"""What holds for all tests: the same examples in every run, a cache of their own; and reports at once."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from deltalux import _core
from hypothesis import settings
from real_scenes import FOLDER
from thoroughness import in_other_half

collect_ignore = [] if FOLDER.is_dir() else ["python/readers/test_gltf_shared_scenes.py"]

settings.register_profile("same", deadline=None, derandomize=True)
settings.register_profile("new", deadline=None, print_blob=True)  # --hypothesis-profile=new: other examples
settings.load_profile("same")


def _listed(name: str) -> frozenset[str]:
    lines = (Path(__file__).parent / name).read_text(encoding="utf-8").splitlines()
    return frozenset(line for line in lines if line and not line.startswith("#"))


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark what `make test` leaves out: the tests of slow.txt, but for those of promises.txt."""
    left_out, kept = _listed("slow.txt"), _listed("promises.txt")
    files, run = set(), set()
    for item in items:
        file = item.nodeid.partition("::")[0]
        files.add(file)
        if item.nodeid not in kept and not left_out.isdisjoint({file, item.nodeid}):
            item.add_marker("slow")
        elif item.get_closest_marker("slow") is None:
            run.add(item.nodeid)
    missing = [name for name in sorted(kept - run) if name.partition("::")[0] in files]
    halves: tuple[list[pytest.Item], list[pytest.Item]] = ([], [])  # what runs, what does not
    for item in items:
        skipped = item.get_closest_marker("slow") is not None and in_other_half(item.nodeid)
        halves[skipped].append(item)
    items[:] = halves[False]
    if halves[True]:
        config.hook.pytest_deselected(items=halves[True])
    if missing and not any("::" in argument for argument in config.args):
        raise pytest.UsageError(f"tests/promises.txt: {missing[0]} is not there, or marked as slow itself")


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
