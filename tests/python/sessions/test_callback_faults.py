# SPDX-License-Identifier: Apache-2.0
"""A progress callback that raises or says no, one call after another: the state is that before or after."""

from __future__ import annotations

import functools

import deltalux as dl
import pytest
from deltalux import _core
from rooms import box, room, samples_in, translation
from thoroughness import calls, slow

OPTIONS = {"paths": 8_000, "gather": 24, "threads": 1} | dict.fromkeys(
    ("static_method", "moving_method"), "disc_index"
)
FIRST = translation(0.7, 0.31, 0.4)  # of the block
LAMP = translation(-1.0, 0.6, -0.5)
NEXT = translation(-0.5, 0.7, 0.3)


@pytest.fixture(autouse=True)
def reports():
    """Reports often enough for some calls in each update, however fast the machine is."""
    _core.set_report_seconds(0.002)
    yield
    _core.set_report_seconds(0.02)


class Own(ValueError):
    """What a callback raises; readers of files take errors of this kind for damage."""


class Failing:
    """A callback that raises or says no at its k-th call."""

    def __init__(self, k, raises):
        self._left, self.error = k, Own("of the callback") if raises else None
        self.failed = False

    def __call__(self, stage, fraction):
        self._left -= 1
        if self._left:
            return None
        self.failed = True
        if self.error is not None:
            raise self.error
        return False


def fails(call, failing):
    """Whether `call` failed; then by what the callback did and nothing else."""
    try:
        call()
    except (Own, dl.Error) as error:
        assert error is failing.error if failing.error else type(error) is dl.Cancelled
        assert failing.failed
        return True
    assert not (failing.failed and failing.error)
    return False


def new_lamp():
    return dl.Mesh("new", *box((0.2, 0.2, 0.2)), "glow", pose=translation(0.4, 0.7, -0.2), movable=True)


# What is edited, and how that is undone.
EDITS = {
    "move": (lambda s: s.move("lamp", translation(0.9, 1.2, -0.4)), lambda s: s.move("lamp", LAMP)),
    "remove": (lambda s: s.remove("lamp"), lambda s: s.add("lamp")),
    "add": (lambda s: s.add("spare"), lambda s: s.remove("spare")),
    "insert": (lambda s: s.add(new_lamp()), None),
    "dim": (lambda s: s.dim("desk", 0.3), lambda s: s.dim("desk", 1)),
    "reflectance": (
        lambda s: s.set_reflectance("wall", (0.3, 0.6, 0.2)),
        lambda s: s.set_reflectance("wall", (0.6, 0.5, 0.4)),
    ),
}


SPARE = dl.Mesh("spare", *box((0.5, 0.2, 0.5)), "glow", pose=translation(-0.6, 1.5, 0.6), movable=True)
SCENE = room().with_mesh(SPARE)
SAMPLES = samples_in(SCENE)


def make_session():
    return dl.Session(SCENE, SAMPLES, **OPTIONS)


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    """A baked session without its spare lamp."""
    path = tmp_path_factory.mktemp("faults") / "room.dlx"
    with make_session() as session:
        session.remove("spare")
        session.bake()
        session.save(path)
    return path


@functools.cache
def digests_of(file, kind):
    """Before the edit, after it, and after the next one: by sessions that nothing happened to."""
    with dl.Session.open(file, threads=1) as session:
        digests = [session.digest()]
        for edit in (EDITS[kind][0], lambda s: s.move("block", NEXT)):
            edit(session)
            session.update()
            digests.append(session.digest())
    with make_session() as fresh:
        fresh.remove("spare")
        fresh.bake()
        EDITS[kind][0](fresh)
        fresh.move("block", NEXT)
        assert fresh.digest() == digests[-1]
    return digests


def recovers(session, after, following):
    """What was asked for comes with the next call, and the update after it is right."""
    session.progress = None
    assert session.digest() == after
    session.move("block", NEXT)
    session.update()
    assert session.digest() == following


def undo(session, kind, before):
    EDITS[kind][1](session)
    session.move("block", FIRST)
    assert session.digest() == before


@pytest.mark.parametrize("raises", [True, slow(False)])
@pytest.mark.parametrize("kind", EDITS)
def test_an_update(file, kind, raises):
    before, after, following = digests_of(file, kind)
    session = dl.Session.open(file, threads=1)
    for k in calls():
        EDITS[kind][0](session)
        session.progress = failing = Failing(k, raises)
        fails(session.update, failing)
        recovers(session, after, following)
        if not failing.failed:
            break
        if EDITS[kind][1] is None:
            session.close()
            session = dl.Session.open(file, threads=1)
        else:
            undo(session, kind, before)
    session.close()
    assert k > 1 or kind != "reflectance"


class EndsWith:
    """A core whose next call of a method ends with an error that the callback raised when all was done."""

    def __init__(self, session, method, error):
        self._session, self._core, self._method, self._error = session, session._core, method, error
        session._core = self

    def __getattr__(self, name):
        real = getattr(self._core, name)
        if name != self._method:
            return real

        def call(*arguments):
            self._session._core = self._core
            real(*arguments)
            raise self._error

        return call


@pytest.mark.parametrize("kind", EDITS)
def test_an_update_that_was_done_already(file, kind):
    _, after, following = digests_of(file, kind)
    with dl.Session.open(file, threads=1) as session:
        EDITS[kind][0](session)
        error = Own("late")
        EndsWith(session, "update", error)
        with pytest.raises(Own) as caught:
            session.update()
        assert caught.value is error
        recovers(session, after, following)


@pytest.mark.parametrize("raises", [True, slow(False)])
def test_a_bake(raises):
    _core.set_report_seconds(0.01)
    with make_session() as session:
        session.bake()
        baked = session.digest()
        session.move("block", NEXT)
        following = session.digest()
    for k in calls():
        with make_session() as session:
            session.progress = failing = Failing(k, raises)
            fails(session.bake, failing)
            session.progress = None
            if not session.baked:
                session.bake()
            recovers(session, baked, following)
        if not failing.failed:
            break
    assert k > 1


def test_a_bake_that_was_done_already(file, tmp_path):
    """The light is there, and can be saved."""
    path = tmp_path / "a.dlx"
    with make_session() as session:
        session.remove("spare")
        EndsWith(session, "bake", Own("late"))
        with pytest.raises(Own):
            session.bake()
        session.save(path)
    with dl.Session.open(path) as opened, dl.Session.open(file) as other:
        assert opened.foreign_build is None
        assert opened.digest() == other.digest()


@pytest.mark.parametrize("raises", [slow(True), False])
def test_a_bake_over_a_bake_and_a_recompute(file, raises):
    _core.set_report_seconds(0.01)
    with dl.Session.open(file, threads=1) as session:
        before = session.digest()
        session.move("block", NEXT)
        following = session.digest()
        for work in (session.bake, session.recompute):
            for k in calls():
                session.move("block", FIRST)
                session.update()
                session.progress = failing = Failing(k, raises)
                fails(work, failing)
                recovers(session, before, following)
                if not failing.failed:
                    break


@pytest.mark.parametrize("raises", [True, slow(False)])
def test_a_save(file, tmp_path, raises):
    """What is queued is worked off first."""
    _, after, _ = digests_of(file, "reflectance")
    path = tmp_path / "a.dlx"
    for k in calls():
        path.write_bytes(b"old")
        with dl.Session.open(file, threads=1) as session:
            EDITS["reflectance"][0](session)
            session.progress = failing = Failing(k, raises)
            if fails(lambda session=session: session.save(path), failing):
                assert path.read_bytes() == b"old"
                session.progress = None
                session.save(path)
        with dl.Session.open(path, threads=1) as saved:
            assert saved.digest() == after
        if not failing.failed:
            break
    assert k > 1


@pytest.mark.parametrize("raises", [True, False])
def test_an_open(file, raises):
    before, after, _ = digests_of(file, "reflectance")
    for k in calls():
        failing = Failing(k, raises)
        fails(lambda failing=failing: dl.Session.open(file, threads=1, progress=failing).close(), failing)
        if not failing.failed:
            break
    assert k > 1
    with dl.Session.open(file, threads=1) as session:
        assert session.digest() == before
        EDITS["reflectance"][0](session)
        assert session.digest() == after
