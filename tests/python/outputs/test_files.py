# SPDX-License-Identifier: Apache-2.0
"""Files that appear whole or not at all: several writers, full disks, modes, kills."""

from __future__ import annotations

import errno
import gc
import os
import resource
import stat
import subprocess
import sys
import threading
from contextlib import contextmanager
from pathlib import Path

import deltalux as dl
import deltalux.files
import pytest
from deltalux.files import written_aside
from deltalux.outputs import write
from deltalux.outputs.of_session import baked_of
from rooms import room
from thoroughness import slow

KILL_SAVE = Path(__file__).parents[3] / "benchmarks" / "kill_save.py"
EXPORTS = [".dlx", ".glb", ".npz", ".csv", ".png"]


@pytest.fixture(params=["nameless", "named"])
def either_way(request, monkeypatch):
    """File systems with and without files that have no name."""
    if request.param == "named":
        monkeypatch.setattr(deltalux.files, "_DESCRIPTORS", Path("/nowhere"))


def put(path, content):
    with written_aside(path) as file:
        file.write(content)


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def mode(path):
    return stat.S_IMODE(path.stat().st_mode)


@pytest.mark.usefixtures("either_way")
def test_new_files_follow_the_umask_and_old_ones_keep_their_mode(tmp_path):
    path = tmp_path / "a"
    before = os.umask(0o027)
    try:
        put(path, b"1")
        assert mode(path) == 0o640
        path.chmod(0o606)
        put(path, b"2")
        assert (mode(path), path.read_bytes()) == (0o606, b"2")
    finally:
        os.umask(before)
    assert names(tmp_path) == ["a"]


@pytest.mark.usefixtures("either_way")
def test_nothing_is_there_before_the_end_and_an_error_leaves_what_was(tmp_path):
    path = tmp_path / "a"
    with pytest.raises(KeyError), written_aside(path) as file:
        file.write(b"1")
        assert not path.exists()
        raise KeyError
    assert names(tmp_path) == []
    put(path, b"old")
    with pytest.raises(KeyError), written_aside(path) as file:
        file.write(b"new")
        assert path.read_bytes() == b"old"
        raise KeyError
    assert (names(tmp_path), path.read_bytes()) == (["a"], b"old")


@pytest.mark.usefixtures("either_way")
def test_threads_that_write_one_path_all_succeed(tmp_path):
    path, failed = tmp_path / "a", []
    barrier = threading.Barrier(4)

    def work(number):
        barrier.wait()
        for _ in range(25):
            try:
                put(path, bytes([number]) * 100_000)
            except OSError as error:
                failed.append(error)

    threads = [threading.Thread(target=work, args=(number,)) for number in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert failed == []
    content = path.read_bytes()
    assert len(content) == 100_000
    assert len(set(content)) == 1
    assert names(tmp_path) == ["a"]


@pytest.mark.usefixtures("either_way")
def test_processes_that_write_one_path_all_succeed(tmp_path):
    path, children = tmp_path / "a", []
    for number in range(3):
        children.append(os.fork())
        if children[-1] == 0:
            try:
                for _ in range(30):
                    put(path, bytes([number]) * 300_000)
                os._exit(0)
            finally:
                os._exit(1)
    assert [os.waitpid(child, 0)[1] for child in children] == [0, 0, 0]
    content = path.read_bytes()
    assert (len(content), len(set(content))) == (300_000, 1)
    assert names(tmp_path) == ["a"]


@pytest.mark.usefixtures("either_way")
def test_links_are_replaced_not_followed(tmp_path):
    (tmp_path / "other").write_bytes(b"other")
    (tmp_path / "a").symlink_to("other")
    put(tmp_path / "a", b"new")
    assert not (tmp_path / "a").is_symlink()
    assert (tmp_path / "other").read_bytes() == b"other"


def test_a_file_that_lies_where_the_part_would_is_never_opened(tmp_path, monkeypatch):
    """Somebody who guessed the name gains nothing: the file is created, or it is an error."""
    monkeypatch.setattr(deltalux.files, "_DESCRIPTORS", Path("/nowhere"))
    monkeypatch.setattr(deltalux.files.secrets, "token_hex", lambda count: "guessed")
    (tmp_path / "victim").write_bytes(b"whole")
    (tmp_path / ".a.guessed.part").symlink_to("victim")
    with pytest.raises(FileExistsError):
        put(tmp_path / "a", b"new")
    assert (tmp_path / "victim").read_bytes() == b"whole"


def test_data_reach_the_disk_before_the_name_does(tmp_path, monkeypatch):
    calls = []
    monkeypatch.setattr(
        os, "fsync", lambda descriptor: calls.append(stat.S_IFMT(os.fstat(descriptor).st_mode))
    )
    replace = os.replace
    monkeypatch.setattr(os, "replace", lambda *a, **k: (calls.append("rename"), replace(*a, **k)))
    put(tmp_path / "a", b"1")
    assert calls == [stat.S_IFREG, "rename", stat.S_IFDIR]


def test_places_that_hold_no_file_are_refused(tmp_path):
    (tmp_path / "folder").mkdir()
    os.mkfifo(tmp_path / "pipe")
    for name in ("folder", "pipe"):
        with pytest.raises(FileExistsError, match="found a folder, device or pipe of that name") as caught:
            put(tmp_path / name, b"1")
        assert caught.value.filename == str(tmp_path / name)
    with pytest.raises(FileNotFoundError):
        put(tmp_path / "absent" / "a", b"1")
    put(tmp_path / ("n" * 255), b"1")  # as long as names may be


# ---- full disks -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def baked():
    scene = room()
    samples = dl.Samples.on_vertices(scene, spacing=0.5, radius=0.15)
    with dl.Session(scene, samples, paths=3000, gather=16, threads=1) as session:
        session.bake()
        yield session


@contextmanager
def no_file_beyond(size):
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


def export(session, path):
    if path.suffix == ".dlx":
        session.save(path)
    else:
        write(path, baked_of(session, "test"))


@pytest.mark.filterwarnings("error::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize(
    ("suffix", "share"), [(".dlx", 0.0), (".dlx", 0.999), *((suffix, 0.5) for suffix in EXPORTS)]
)
def test_a_disk_that_is_full_loses_nothing(baked, tmp_path, suffix, share):
    path = tmp_path / f"room{suffix}"
    export(baked, path)
    old = path.read_bytes()
    with no_file_beyond(int(share * len(old))), pytest.raises(OSError, match="as before") as caught:
        export(baked, path)
    assert caught.value.errno == errno.EFBIG
    assert caught.value.filename == str(path)
    assert "nothing was written" in caught.value.strerror
    gc.collect()
    assert path.read_bytes() == old
    assert names(tmp_path) == [path.name]


SAVE_TWICE = """
import errno, subprocess, sys
from pathlib import Path
import deltalux as dl

file, place, size = Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3]
if subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", str(place)]).returncode:
    sys.exit("no mount")
with dl.Session.open(file) as session:
    session.save(place / "room.dlx")
    try:
        session.save(place / "room.dlx")
    except OSError as error:
        assert error.errno == errno.ENOSPC and "nothing was written" in str(error), error
    else:
        raise AssertionError("both fit")
    assert [path.name for path in place.iterdir()] == ["room.dlx"]
    with dl.Session.open(place / "room.dlx") as opened:
        assert opened.digest() == session.digest()
"""


def test_a_small_file_system_that_is_full_loses_nothing(baked, tmp_path):
    """In a process of its own, which sees a file system that others do not."""
    file, place = tmp_path / "room.dlx", tmp_path / "small"
    place.mkdir()
    baked.save(file)
    size = file.stat().st_size * 3 // 2  # room for one and a half
    user = [] if os.geteuid() == 0 else ["--user", "--map-root-user"]
    words = [sys.executable, "-c", SAVE_TWICE, str(file), str(place), str(size)]
    done = subprocess.run(["unshare", "--mount", *user, *words], capture_output=True, text=True, check=False)
    if "no mount" in done.stderr or "unshare failed" in done.stderr:
        pytest.skip("file systems cannot be mounted here")
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(("kills", "exports", "least"), [(4, 0, 1), slow(5, 1, 1)])
def test_killed_writers_leave_whole_files(kills, exports, least):
    """The short form of the program; its 1,000 kills are in benchmarks/RESULTS.md."""
    ran = subprocess.run(
        [sys.executable, str(KILL_SAVE), "--kills", str(kills), "--exports", str(exports)],
        capture_output=True, text=True, timeout=280, check=False,
    )  # fmt: skip
    assert ran.returncode == 0, ran.stdout + ran.stderr
    files = kills + exports * len(set(EXPORTS) - {".dlx"})  # the kills are of sessions
    assert f"whole: {files} of {files}" in ran.stdout
    during = int(ran.stdout.split(f".dlx: {kills} kills, ")[1].split()[0])
    assert during >= least  # they did meet the write
