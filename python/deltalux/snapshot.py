# SPDX-License-Identifier: Apache-2.0
"""Session files (.dlx): a versioned zip of arrays and a JSON index, read completely or refused."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from .archive import PIECE, ArchiveReader, ArchiveWriter
from .core_session import SessionOptions
from .errors import Cancelled, FormatError, OptionError, SceneError
from .fields import Fields
from .files import written_aside
from .segments import Progress, check_threads
from .stored_samples import FIELDS as SAMPLE_FIELDS
from .stored_samples import pack_samples, unpack_samples, write_samples
from .stored_scene import FIELDS as SCENE_FIELDS
from .stored_scene import pack_scene, unpack_scene, write_scene
from .version import __version__

if TYPE_CHECKING:
    from .session import Session

FORMAT = "deltalux-session"
VERSION = 17  # increases only when the layout or the meaning of a number changes
_FIELDS = ("format", "version", "options", "scene", "samples", "baked", "reflectances", "built_by", "made_by")
_LONGEST_BUILD = 500  # characters of the name of a build
_MOST_COMMANDS, _LONGEST_COMMAND = 100, 4000  # of those that made a file, the last ones; characters of each
CORE = "core/"  # before the names of the core's arrays
# Exceptions that unsuitable arrays or options may raise while a session is restored.
_MISFITS = (
    KeyError,
    TypeError,
    ValueError,
    IndexError,
    AttributeError,
    OverflowError,
    OptionError,
    SceneError,
)


def write(path: Path, session: Session, command: str = "Session.save") -> None:
    """Write `session` to `path`, under a temporary name first; the core's arrays are written in pieces.

    `command` tells readers of the file which command wrote it.

    Raises
    ------
    Cancelled
        If the session's callback asks to stop; a file at `path` is as it was before.
    """
    told = _Told(session.progress)
    index = {
        "format": FORMAT,
        "version": VERSION,
        "options": session._options,
        "scene": pack_scene(session.scene, path.parent),
        "samples": pack_samples(session.samples),
        "baked": session.baked,
        "reflectances": [session._reflectances[m.name] for m in session.scene.materials],
        "built_by": session._built_by,
        "made_by": _with_command(session.made_by, command),
    }
    state = session._session().save()
    with written_aside(path) as file, ArchiveWriter(file) as archive:
        archive.add_index(index)
        write_scene(session.scene, archive)
        write_samples(session.samples, archive)
        told.all = sum(map(state.bytes, state.names()))
        for name in state.names():
            size = state.bytes(name)
            archive.add_bytes(CORE + name, "|u1", (size,), _pieces(state, name, size, told))


def _with_command(earlier: tuple[str, ...], command: str) -> list[str]:
    """The commands that made a file: the earlier ones, and this version's, which is not repeated."""
    line = f"deltalux {__version__}: {command}"[:_LONGEST_COMMAND]
    return [*(earlier[:-1] if earlier[-1:] == (line,) else earlier), line][-_MOST_COMMANDS:]


class _Told:
    """Tells a progress callback how much has been written."""

    def __init__(self, progress: Progress | None) -> None:
        self._progress = progress
        self.all, self._done = 1, 0
        self.more(0)

    def more(self, size: int) -> None:
        self._done += size
        if self._progress and self._progress("save session", self._done / self.all) is False:
            raise Cancelled("save: cancelled by the progress callback; no file was written")


def _pieces(state: Any, name: str, size: int, told: _Told) -> Iterator[bytes]:
    for begin in range(0, size, PIECE):
        piece = state.read(name, begin, min(PIECE, size - begin))
        yield piece
        told.more(len(piece))


def read(path: Path, kind: type[Session], threads: int | None, progress: Progress | None) -> Session:
    """Open a file that `write` wrote.

    Raises
    ------
    FormatError
        If it is missing, truncated, foreign, damaged or of another version.
    """
    check_threads(threads)
    watched = None if progress is None else _Watched(progress)
    try:
        if watched is not None and watched("open session", 0.0) is False:
            raise Cancelled("open: cancelled by the progress callback")
        session = _read(path, kind, threads, watched)
    except FormatError:
        if watched is not None and watched.error is not None:
            raise watched.error from None
        raise
    session.progress = progress
    return session


class _Watched:
    """A progress callback whose exceptions are kept apart from those that the file causes."""

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self.error: Exception | None = None

    def __call__(self, stage: str, fraction: float) -> bool | None:
        try:
            return self._progress(stage, fraction)
        except Exception as error:
            self.error = error
            raise


def _read(path: Path, kind: type[Session], threads: int | None, progress: Progress | None) -> Session:
    with reading(path) as archive:
        session = _restore(archive, path.parent, kind, threads, progress)
        archive.check_all_read()
        return session


@contextmanager
def reading(path: Path) -> Iterator[ArchiveReader]:
    """Open the archive of a session file; any error in it becomes a FormatError that names the file."""
    try:
        with ArchiveReader(path) as archive:
            _check_index(archive.index)
            yield archive
    except FileNotFoundError:
        raise FormatError(f"{path}: no such file") from None
    except FormatError as error:
        raise FormatError(f"{path}: {error}") from None
    except (zipfile.BadZipFile, NotImplementedError, EOFError, OSError) as error:
        raise FormatError(
            f"{path}: found a file that is truncated, damaged or no session, "
            f"expected one that Session.save wrote ({error})"
        ) from None
    except _MISFITS as error:
        raise FormatError(f"{path}: the session's parts do not fit together ({error!r:.300})") from None


def _check_index(index: Any) -> None:
    """Raise FormatError unless an archive's index is that of a session of this version."""
    if not isinstance(index, dict) or index.get("format") != FORMAT:
        raise FormatError("found a foreign file, expected a session that Session.save wrote")
    if index.get("version") != VERSION:
        found = f"{index.get('version')!r:.20}"
        raise FormatError(f"found session format {found}, this program reads {VERSION}; bake again")


def index_fields(archive: ArchiveReader) -> Fields:
    """The index, restricted to the fields of a session."""
    return Fields(archive.index, "index", _FIELDS)


def made_by(index: Fields) -> tuple[str, ...]:
    """The commands that made the file, one line each, oldest first."""
    return tuple(line[:_LONGEST_COMMAND] for line in index.texts("made_by")[-_MOST_COMMANDS:])


class _CoreSource:
    """The core's arrays by the names that the core gives them."""

    def __init__(self, archive: ArchiveReader) -> None:
        self._archive = archive

    def bytes(self, name: str) -> int | None:
        return self._archive.bytes(CORE + name)

    def read_into(self, name: str, buffer: memoryview) -> None:
        self._archive.read_into(CORE + name, buffer)


def _restore(
    archive: ArchiveReader,
    folder: Path,
    kind: type[Session],
    threads: int | None,
    progress: Progress | None,
) -> Session:
    index = index_fields(archive)
    options = index.child("options", SessionOptions.__annotations__)
    values = {name: options.any(name) for name in SessionOptions.__annotations__}
    if threads is not None:
        values["threads"] = threads
    scene = unpack_scene(index.child("scene", SCENE_FIELDS), archive, folder)
    samples = unpack_samples(index.child("samples", SAMPLE_FIELDS), scene, archive)
    session = kind(scene, samples, progress=progress, **values)
    session._prepare_choice()
    session._session().restore(_CoreSource(archive), progress)
    if session.baked != index.boolean("baked"):
        raise FormatError("found light in one of index and arrays only")
    _adopt(session, index)
    return session


def _adopt(session: Session, index: Fields) -> None:
    """Restore the Python side of a session from the core's state and the index."""
    core = session._session()
    state = core.save()
    # 3 rows of the matrix, then the translation
    poses = np.frombuffer(state["poses"], np.float64).reshape(-1, 4, 3)
    present = np.frombuffer(state["present"], np.uint8)
    factors = np.frombuffer(state["group_factor"], np.float64)
    for name, number in session._flat.objects.items():
        if name in session._poses:
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = poses[number, :3], poses[number, 3]
            session._poses[name] = session._flat.user_pose(name, pose)
        if not present[number]:
            session._removed.add(name)
    for name, number in session._flat.groups.items():
        session._factors[name] = float(factors[number])
    session._box = core.world() + session._flat.origin
    materials = session.scene.materials
    given = index.numbers("reflectances", len(materials), 3, least=0, most=1)
    used = np.frombuffer(state["reflectance"], np.float32).reshape(-1, 3)
    if not np.array_equal(given.astype(np.float32), used):
        raise FormatError("found other reflectances in the index than in the arrays")
    session._reflectances = {
        m.name: (row[0], row[1], row[2]) for m, row in zip(materials, given.tolist(), strict=True)
    }
    present_build = core.description()
    session.made_by = made_by(index)
    session._built_by = index.text("built_by")[:_LONGEST_BUILD] if session.baked else None
    if session.baked and session._built_by != present_build:
        session.foreign_build = f"{session._built_by}; this is {present_build}"
