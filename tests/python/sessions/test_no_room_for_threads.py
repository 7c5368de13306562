# SPDX-License-Identifier: Apache-2.0
"""No memory for another thread: one error of the package, and nothing is lost."""

from __future__ import annotations

import subprocess
import sys
import threading
from pathlib import Path

import deltalux as dl
import pytest
from deltalux import threads
from deltalux.cli import failures, run
from deltalux.cli.commands import info
from deltalux.errors import Error
from thoroughness import slow

# In a process of its own, because stacks of threads that ended are used again. What follows is its last
# part: `call` runs without room for a stack, `after` with it.
PREPARED = """
import os, resource, sys, threading
import deltalux as dl

def set_room(more):
    used = 4096 * int(open("/proc/self/statm").read().split()[0])
    resource.setrlimit(resource.RLIMIT_AS, (used + more if more else hard, hard))

hard = resource.getrlimit(resource.RLIMIT_AS)[1]
samples = dl.Samples([(0, .5, 0)], (0, 1, 0))
session = dl.Session(dl.scenes.cornell_box(), samples, paths=500, gather=8, threads={threads})
end = threading.Event()

def taking_stacks():
    # What is kept of stacks for later threads goes to these.
    try:
        for _ in range(64):
            threading.Thread(target=end.wait, daemon=True).start()
    except RuntimeError:
        pass

if {baked}:
    session.bake()
    before = session.irradiance[0, 1]
    session.dim("ceiling", 0.5)
set_room(1 << 20)
taking_stacks()
try:
    {call}
    print("it went well")
except (dl.Error, MemoryError) as error:
    print(error)
except Exception as error:
    print("other:", type(error).__name__, error)
set_room(0)
end.set()
session.update() if {baked} else session.bake()
if {baked}:
    assert session.irradiance[0, 1] < 0.6 * before, "the edit is lost"
    updated = session.digest()
    session.recompute()
    assert session.digest() == updated
print("and then", flush=True)
os._exit(0)
"""
CALLS = {
    "bake": (False, "session.bake()"),
    "bake again": (True, "session.bake()"),
    "update": (True, "session.update()"),
    "update in time": (True, "session.update(budget_ms=1.0)"),
    "recompute": (True, "session.recompute()"),
    "light elsewhere": (True, "session.at([(0.1, .5, 0)], (0, 1, 0))"),
}
NO_ROOM = "found no room for another one (Resource temporarily unavailable), expected one for each call"


@pytest.mark.skipif(not Path("/proc/self/statm").exists(), reason="reads what memory is in use from /proc")
@pytest.mark.parametrize("count", [slow(1), 2])
@pytest.mark.parametrize(("baked", "call"), CALLS.values(), ids=CALLS)
def test_a_call_without_a_thread_fails_in_one_error_and_can_be_repeated(baked, call, count):
    code = PREPARED.format(baked=baked, call=call, threads=count)
    sources = str(Path(dl.__file__).parents[1])
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=120, env={"PYTHONPATH": sources}
    )
    assert done.returncode == 0, done.stderr
    first, last = done.stdout.splitlines()
    assert NO_ROOM in first and "ulimit" in first
    assert last == "and then"


@pytest.fixture
def no_threads(monkeypatch):
    def refuse(self):
        raise RuntimeError(failures.NO_THREAD)

    monkeypatch.setattr(threading.Thread, "start", refuse)


def test_a_thread_of_the_package_is_named(no_threads):
    with pytest.raises(Error, match=r"no room for another one \(can't start new thread\), expected .* mine;"):
        threads.start(threading.Thread(name="mine"))


def test_a_command_tells_it_in_one_line(no_threads, monkeypatch, capsys):
    def fails(*_, **__):
        threading.Thread().start()

    monkeypatch.setattr(info, "open_scene", fails)
    assert run(["info", "cornell_box"]) == 1
    assert capsys.readouterr().err.startswith("error: out of memory")


def test_other_failures_of_that_kind_are_defects(monkeypatch):
    def fails(*_, **__):
        raise RuntimeError("a defect")

    monkeypatch.setattr(info, "open_scene", fails)
    with pytest.raises(RuntimeError, match="a defect"):
        run(["info", "cornell_box"])
