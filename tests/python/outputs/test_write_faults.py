# SPDX-License-Identifier: Apache-2.0
"""Each call that a file is written by fails, once or for good: nothing that was there is lost."""

from __future__ import annotations

import errno
import io
import itertools
import os
from pathlib import Path

import deltalux as dl
import deltalux.files
import numpy as np
import pytest
from deltalux.outputs import Picture, write
from deltalux.outputs.of_session import baked_of
from rooms import room

METHODS = {"static_method": "disc_index", "moving_method": "disc_index"}  # no time is spent on a choice
CALLS = ("open", "stat", "fchmod", "fsync", "link", "replace")  # beside the writes
CODES = (errno.ENOSPC, errno.EIO)
HARMLESS = {  # calls whose failure costs nothing: there is another way, or the file is in its place
    "open of a file without a name",
    "open of the folder after the renaming",
    "fsync of the folder",
}


class FailingSystem:
    """`os` for `deltalux.files`: from the k-th call on it fails, once or for good; cleaning up works."""

    def __init__(self, k, for_good):
        self._left, self._for_good = k, for_good
        self._replaced = False
        self.failed = []  # what was asked for

    def __getattr__(self, name):
        real = getattr(os, name)
        if name not in CALLS:
            return real

        def call(*arguments, **keywords):
            self.meet(self._asked(name, arguments))
            found = real(*arguments, **keywords)
            self._replaced = self._replaced or name == "replace"
            return found

        return call

    def _asked(self, name, arguments):
        if name == "open" and arguments[1] & os.O_TMPFILE == os.O_TMPFILE:
            return "open of a file without a name"
        if name == "open" and self._replaced:
            return "open of the folder after the renaming"
        return "fsync of the folder" if name == "fsync" and self._replaced else name

    def meet(self, what):
        self._left -= 1
        if self._left == 0 or (self._for_good and self._left < 0):
            self.failed.append(what)
            code = CODES[len(what) % 2]
            raise OSError(code, os.strerror(code))

    def fdopen(self, descriptor, mode):
        return io.BufferedRandom(FailingFile(self, descriptor, mode))


class FailingFile(io.FileIO):
    """A file whose writes fail with the system."""

    def __init__(self, system, descriptor, mode):
        super().__init__(descriptor, mode)
        self._system = system

    def write(self, data):
        self._system.meet("write")
        return super().write(data)


@pytest.fixture(scope="module")
def baked():
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=1.5, radius=0.15)
    with dl.Session(scene, samples, paths=100, threads=1, gather=16, **METHODS) as session:
        session.bake()
        yield session


# Without the rendering, which takes a while.
PICTURE = Picture(np.random.default_rng(1).integers(0, 255, (60, 80, 3), np.uint8))


def export(session, path):
    if path.suffix == ".dlx":
        session.save(path)
    elif path.suffix == ".png":
        PICTURE.save(path)
    else:
        write(path, baked_of(session, "test"))


def open_descriptors():
    return len(os.listdir("/proc/self/fd"))  # noqa: PTH208


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("for_good", [True, False])
@pytest.mark.parametrize("nameless", [True, False])
@pytest.mark.parametrize(
    ("suffix", "exists"),
    [(".dlx", True), (".dlx", False), (".glb", True), (".npz", True), (".csv", True), (".png", True)],
)
def test_a_call_that_fails_loses_nothing(baked, tmp_path, monkeypatch, suffix, nameless, for_good, exists):
    path = tmp_path / f"room{suffix}"
    export(baked, path)
    new, old = path.read_bytes(), b"what was there"
    digest, descriptors = baked.digest(), open_descriptors()
    met = set()
    if not nameless:
        monkeypatch.setattr(deltalux.files, "_DESCRIPTORS", Path("/nowhere"))
    for k in itertools.count(1):
        path.write_bytes(old) if exists else path.unlink(missing_ok=True)
        system = FailingSystem(k, for_good)
        with monkeypatch.context() as patch:
            patch.setattr(deltalux.files, "os", system)
            try:
                export(baked, path)
            except OSError as error:
                text = str(error)
            else:
                text = None
        if not system.failed:
            break
        met.update(system.failed)
        if text is None:
            assert set(system.failed) <= HARMLESS
            assert path.read_bytes() == new
        else:
            assert not set(system.failed) <= HARMLESS
            assert str(path) in text
            assert text.count("o space left") + text.count("nput/output error") == 1
            begun = system.failed[-1] in ("write", "fsync", "link", "replace")
            assert ("nothing was written, what was there is as before" in text) == begun
            assert (path.read_bytes() if path.exists() else None) == (old if exists else None)
        assert [each.name for each in tmp_path.iterdir()] == [path.name] * path.exists()
        assert open_descriptors() == descriptors
        assert baked.digest() == digest
    assert {"open", "stat", "write", "fsync", "replace", *HARMLESS} - met <= {"open of a file without a name"}
    assert ("open of a file without a name" in met) == ("link" in met) == nameless
    assert ("fchmod" in met) == exists
    export(baked, path)
    assert path.read_bytes() == new
