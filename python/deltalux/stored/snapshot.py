# SPDX-License-Identifier: Apache-2.0
"""Session files (.dlx): a versioned zip of arrays and a JSON index, read completely or refused."""

from __future__ import annotations

import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from deltalux.errors import Cancelled, FormatError, OptionError, SceneError
from deltalux.files import written_aside
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress
from deltalux.session_options import OPTIONS
from deltalux.version import __version__

from .archive import PIECE, ArchiveReader, ArchiveWriter
from .fields import Fields
from .samples import FIELDS as SAMPLE_FIELDS
from .samples import pack_samples, unpack_samples, write_samples
from .scene import FIELDS as SCENE_FIELDS
from .scene import pack_scene, unpack_scene, write_scene

FORMAT = "deltalux-session"
VERSION = 27  # increases only when the layout or the meaning of a number changes
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


@dataclass(frozen=True, eq=False)
class StoredSession:
    """What a session file holds beside the core's arrays.

    Parameters
    ----------
    scene : with meshes that were added, but in the state that it was loaded in
    samples : Samples
    options : those that the session was made with; what a file says of them is checked by who makes one
    baked : whether there is light
    reflectances : (m, 3) float64, present ones of the scene's materials
    built_by : the build that computed the light, None without light
    made_by : what made the file, a line for each command, the last one last
    """

    scene: Scene
    samples: Samples
    options: dict[str, Any]
    baked: bool
    reflectances: np.ndarray
    built_by: str | None
    made_by: tuple[str, ...]


def write(path: Path, stored: StoredSession, core: Any, command: str, progress: Progress | None) -> None:
    """Write a session to `path`, aside and then renamed; the core's arrays go there piece by piece.

    Parameters
    ----------
    stored : with what made the files that the session comes from
    core : the core's session, which has the arrays
    command : what makes this file, for whoever reads it
    progress : callable (stage, fraction) -> keep going, or None

    Raises
    ------
    Cancelled
        Where the callback asks to stop; what was there is as before.
    """
    told = _Told(progress)
    index = {
        "format": FORMAT,
        "version": VERSION,
        "options": stored.options,
        "scene": pack_scene(stored.scene, path.parent),
        "samples": pack_samples(stored.samples),
        "baked": stored.baked,
        "reflectances": stored.reflectances.tolist(),
        "built_by": stored.built_by,
        "made_by": _with_command(stored.made_by, command),
    }
    state = core.save()
    with written_aside(path) as file, ArchiveWriter(file) as archive:
        archive.add_index(index)
        write_scene(stored.scene, archive)
        write_samples(stored.samples, archive)
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


class Opened(NamedTuple):
    """A session file that is being read."""

    stored: StoredSession
    core_arrays: CoreArrays  # what a session of the core restores itself from
    progress: Progress | None  # whom to tell meanwhile: the errors of this one are not the file's


@contextmanager
def opened(path: Path, progress: Progress | None) -> Iterator[Opened]:
    """A file that `write` made, for a session to be made of within the context.

    Raises
    ------
    FormatError
        Where it is missing, truncated, foreign, damaged or of another version; in place of errors within
        the context, too, where they are of parts that do not fit together.
    """
    watched = None if progress is None else _Watched(progress)
    try:
        if watched is not None and watched("open session", 0.0) is False:
            raise Cancelled("open: cancelled by the progress callback")
        with reading(path) as archive:
            yield Opened(_stored(archive, path.parent), CoreArrays(archive), watched)
            archive.check_all_read()
    except FormatError:
        if watched is not None and watched.error is not None:
            raise watched.error from None
        raise


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
    except (zipfile.BadZipFile, zlib.error, NotImplementedError, EOFError, OSError) as error:
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


class CoreArrays:
    """The core's arrays in a file, by the core's names."""

    def __init__(self, archive: ArchiveReader) -> None:
        self._archive = archive

    def bytes(self, name: str) -> int | None:
        """Size of an array, None where the file has none of that name."""
        return self._archive.bytes(CORE + name)

    def read_into(self, name: str, buffer: memoryview) -> None:
        """Fill `buffer` with an array."""
        self._archive.read_into(CORE + name, buffer)


def stored_options(index: Fields) -> dict[str, Any]:
    """The session's options, unchecked."""
    options = index.child("options", OPTIONS)
    return {name: options.any(name) for name in OPTIONS}


def _stored(archive: ArchiveReader, folder: Path) -> StoredSession:
    index = index_fields(archive)
    values: Any = stored_options(index)
    scene = unpack_scene(index.child("scene", SCENE_FIELDS), archive, folder)
    samples = unpack_samples(index.child("samples", SAMPLE_FIELDS), scene, archive)
    baked = index.boolean("baked")
    return StoredSession(
        scene,
        samples,
        values,
        baked,
        index.numbers("reflectances", len(scene.materials), 3, least=0, most=1),
        index.text("built_by")[:_LONGEST_BUILD] if baked else None,
        made_by(index),
    )
