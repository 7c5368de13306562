# SPDX-License-Identifier: Apache-2.0
"""One session, many threads, callbacks and processes: calls take turns or are refused; none is lost."""

from __future__ import annotations

import copy
import os
import pickle
import random
import sys
import threading
import time
from contextlib import contextmanager

import deltalux as dl
import numpy as np
import pytest
from deltalux.session.calls import Calls
from rooms import room, samples_in, translation

TARGET = translation(-0.5, 0.6, -0.3)
BUSY = "another call is at work"


@pytest.fixture
def baked():
    scene = room()
    with dl.Session(scene, samples_in(scene), paths=20_000, gather=64, threads=1, direct="paths") as session:
        session.bake()
        yield session


class Paused:
    """Holds a thread inside of a method of the core until it is let go."""

    def __init__(self, core, method):
        self._core, self._method = core, method
        self.inside, self.go = threading.Event(), threading.Event()

    def __getattr__(self, name):
        if name != self._method:
            return getattr(self._core, name)

        def paused(*arguments):
            result = getattr(self._core, name)(*arguments)
            self.inside.set()
            assert self.go.wait(60)
            return result

        return paused


class Started(threading.Thread):
    """A thread that keeps its error."""

    def __init__(self, work):
        super().__init__(daemon=True)
        self._work, self.error = work, None
        self.start()

    def run(self):
        try:
            self._work()
        except Exception as error:
            self.error = error

    def wait(self):
        self.join(60)
        assert not self.is_alive()
        return self.error


@contextmanager
def paused_in(session, method):
    core = session._core
    session._core = Paused(core, method)
    try:
        yield session._core
    finally:
        session._core.go.set()
        session._core = core


def place_in_core(session, name):
    poses = np.frombuffer(session._core.save()["poses"], np.float64).reshape(-1, 12)
    return poses[session._flat.objects[name], 9:]


CALLS = {
    "update": lambda s: s.update(),
    "digest": lambda s: s.digest(),
    "save": lambda s: s.save("/dev/null/none.dlx"),
    "recompute": lambda s: s.recompute(),
    "bake": lambda s: s.bake(),
    "read": lambda s: s.irradiance,
    "read_packed": lambda s: s.read_packed(),
    "glance": lambda s: s.glance(),
    "gradient": lambda s: s.gradient,
    "at": lambda s: s.at([(0, 0.5, 0)], [(0, 1, 0)]),
    "result": lambda s: s.result,
    "radius": lambda s: s.radius,
    "sums": lambda s: s.sums,
    "energy": lambda s: s.energy,
    "statistics": lambda s: s.statistics,
    "plan": lambda s: s.plan,
    "move": lambda s: s.move("lamp", translation(0.3, 1, 0.2)),
    "remove": lambda s: s.remove("lamp"),
    "add": lambda s: s.add("nothing"),
    "dim": lambda s: s.dim("desk", 0.5),
    "set_reflectance": lambda s: s.set_reflectance("wall", (0.1, 0.1, 0.1)),
}


@pytest.mark.parametrize("call", ["update", "digest", "recompute", "bake"])
def test_an_edit_that_was_accepted_takes_effect(baked, call):
    """An edit between its check and its place in the queue, while another thread starts to work."""
    with paused_in(baked, "check") as core:
        mover = Started(lambda: baked.move("block", TARGET))
        assert core.inside.wait(60)
        worker = Started(lambda: CALLS[call](baked))
        time.sleep(0.05)
        assert worker.is_alive()  # it waits for the edit
        core.go.set()
        assert mover.wait() is None
        assert worker.wait() is None
    np.testing.assert_array_equal(place_in_core(baked, "block"), TARGET[:3, 3])
    digest = baked.digest()
    baked.recompute()
    assert baked.digest() == digest


@pytest.mark.parametrize("work", ["update", "digest", "recompute", "gradient", "save"])
def test_calls_of_other_threads_are_refused_while_one_works(baked, tmp_path, work):
    """All of them, at once, and nothing of them stays."""
    baked.move("block", TARGET)
    before = baked.poses, baked.dim_factors, baked.reflectances
    long = {"save": lambda: baked.save(tmp_path / "a.dlx")}.get(work, lambda: CALLS[work](baked))
    with paused_in(baked, work) as core:
        worker = Started(long)
        assert core.inside.wait(60)
        for name, call in CALLS.items():
            error = Started(lambda call=call: call(baked)).wait()
            assert isinstance(error, dl.OptionError), name
            assert BUSY in str(error), name
        assert baked.baked
        for found, expected in zip((baked.poses, baked.dim_factors, baked.reflectances), before, strict=True):
            assert found.keys() == expected.keys()
            for key, value in expected.items():
                np.testing.assert_array_equal(found[key], value)
        core.go.set()
        assert worker.wait() is None
    baked.update()
    digest = baked.digest()
    baked.recompute()
    assert baked.digest() == digest
    np.testing.assert_array_equal(place_in_core(baked, "block"), TARGET[:3, 3])


def test_every_call_is_refused_in_a_progress_callback():
    outcomes = {}

    def call_all(stage, fraction):
        for name, call in CALLS.items():
            try:
                outcomes[name] = call(session)
            except Exception as error:
                outcomes[name] = error

    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.1)
    with dl.Session(scene, samples, paths=300_000, gather=16, threads=1, progress=call_all) as session:
        session.bake()
        session.progress = None
        assert outcomes.keys() == CALLS.keys()
        for name, outcome in outcomes.items():
            assert isinstance(outcome, dl.OptionError), name
            assert BUSY in str(outcome), name
        session.update()
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest


def test_many_threads_lose_no_edit():
    """At random: each call is done or refused, and what was accepted is there in the end."""
    scene = room(groups=6)
    names = [f"bulb{i}" for i in range(4)]
    last = {}
    stop = time.monotonic() + 6
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)
    refused, done = [0], [0]

    def attempt(call):
        while True:
            try:
                result = call()
                done[0] += 1
                return result
            except dl.OptionError as error:
                assert BUSY in str(error)
                refused[0] += 1
                time.sleep(1e-4)
                if time.monotonic() > stop + 60:
                    raise

    def edit(name, seed):
        rng = random.Random(seed)
        while time.monotonic() < stop:
            factor = rng.random()
            attempt(lambda factor=factor: session.dim(name, factor))
            last[name] = factor

    def work(seed):
        rng = random.Random(seed)
        while time.monotonic() < stop:
            call = rng.choice(
                [
                    lambda: session.update(budget_ms=1),
                    session.update,
                    session.digest,
                    lambda: session.irradiance,
                ]
            )
            attempt(call)
            attempt(lambda: session.move("block", translation(rng.uniform(-1, 1), 0.6, 0)))

    with dl.Session(scene, samples_in(scene), paths=3000, gather=64, threads=1) as session:
        session.bake()
        try:
            threads = [Started(lambda name=name, i=i: edit(name, i)) for i, name in enumerate(names)]
            threads += [Started(lambda i=i: work(i)) for i in range(4)]
            assert [thread.wait() for thread in threads] == [None] * 8
        finally:
            sys.setswitchinterval(interval)
        session.update()
        factors = np.frombuffer(session._core.save()["group_factor"], np.float64)
        for name in names:
            assert session.dim_factors[name] == last[name] == factors[session._flat.groups[name]]
        np.testing.assert_array_equal(place_in_core(session, "block"), session.pose("block")[:3, 3])
        digest = session.digest()
        session.recompute()
        assert session.digest() == digest
    assert refused[0] > 0
    assert done[0] > 100


def test_calls_are_free_again_after_an_error(baked):
    with pytest.raises(dl.OptionError, match="not in the scene"):
        baked.move("nobody", TARGET)
    with pytest.raises(dl.OptionError, match="budget_ms"):
        baked.update(budget_ms=-1)
    with pytest.raises(OSError, match="none"):
        baked.save("/dev/null/none.dlx")
    baked.update()


def test_short_calls_wait_for_short_ones_and_nobody_for_long_ones():
    calls, order = Calls(), []

    def enter(long):
        with calls.one(long):
            order.append(long)

    with calls.one(long=False):
        waiting = [Started(lambda long=long: enter(long)) for long in (True, False)]
        time.sleep(0.05)
        assert order == []
        with pytest.raises(dl.OptionError, match=BUSY):
            enter(False)  # from inside: waiting would last for ever
    errors = [thread.wait() for thread in waiting]
    assert errors.count(None) == len(order) >= 1
    with calls.one(long=True):
        for long in (True, False):
            assert BUSY in str(Started(lambda long=long: enter(long)).wait())
    assert not calls.locked()


# ---- copies and processes -------------------------------------------------------------------------


@pytest.mark.parametrize("duplicate", [pickle.dumps, copy.copy, copy.deepcopy])
def test_sessions_cannot_be_copied(baked, duplicate):
    with pytest.raises(
        dl.OptionError, match=r"cannot be pickled or copied; save it to a file.*Session\.open"
    ):
        duplicate(baked)
    baked.update()


def test_a_forked_process_is_told_to_open_a_file(baked, tmp_path):
    baked.save(tmp_path / "a.dlx")
    digest = baked.digest()
    hear, tell = os.pipe()
    child = os.fork()
    if child == 0:
        try:
            told = []
            for call in CALLS.values():
                try:
                    call(baked)
                except Exception as error:
                    told.append(f"{type(error).__name__}: {error}")
            with dl.Session.open(tmp_path / "a.dlx", threads=1) as opened:
                told.append(opened.digest())
            baked.close()
            os.write(tell, "\n".join(told).encode())
        finally:
            os._exit(0)
    os.close(tell)
    with os.fdopen(hear) as pipe:
        told = pipe.read().split("\n")
    assert os.waitpid(child, 0)[1] == 0
    assert len(told) == len(CALLS) + 1
    for text in told[:-1]:
        assert text.startswith("OptionError: session: it was made in process"), text
        assert text.endswith("save the session there, and open the file here")
    assert told[-1] == digest
    baked.move("block", TARGET)
    baked.update()
