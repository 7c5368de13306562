# SPDX-License-Identifier: Apache-2.0
"""Result files of a command: suffixes are checked before any work is done; then files are written."""

from __future__ import annotations

import os
import shlex
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import typer

import deltalux as dl
from deltalux.files import found_among, same_file
from deltalux.outputs.baked import Baked, about_text
from deltalux.outputs.of_session import baked_of
from deltalux.outputs.png import write_png
from deltalux.outputs.tables import write_csv, write_npz
from deltalux.outputs.vertex_colors import write_glb
from deltalux.pace import Overall
from deltalux.rendering import fits, render_session

from .jobs import counts_of_session, edges_into, in_pixels
from .options import SESSION
from .shots import PICTURE, Shot

MESH = ".glb"
WRITERS: dict[str, tuple[str, Callable[[Path, Baked], None]]] = {
    MESH: ("lit mesh", write_glb),
    PICTURE: ("picture", write_png),
    ".csv": ("table", write_csv),
    ".npz": ("arrays", write_npz),
}
KINDS = {**{suffix: kind for suffix, (kind, _) in WRITERS.items()}, SESSION: "session"}


def check_targets(
    outputs: Sequence[Path] | None,
    more: Sequence[Path] | None,
    inputs: Sequence[str | Path],
    planes: int = 0,
    kinds: Mapping[str, str] = KINDS,
) -> list[Path]:
    """Return the result files, after checking their kinds and that their places are writable.

    Parameters
    ----------
    outputs : values of -o
    more : words that followed the last value of -o
    inputs : files that the command reads, as far as they are known before reading
    planes : number of working planes; 0 = samples on the surfaces
    kinds : what the command writes, by suffix

    Raises
    ------
    BadParameter : unknown or unsuitable suffix, a file named twice, an input, words that follow no -o
    OSError : the folder is absent or cannot be written to
    """
    if more and not outputs:
        raise typer.BadParameter(f"found the extra word '{more[0]}'; result files follow -o")
    targets = [*(outputs or ()), *(more or ())]
    for path in targets:
        kind = path.suffix.lower()
        if kind not in kinds:
            known = ", ".join(f"{suffix} ({name})" for suffix, name in kinds.items())
            raise typer.BadParameter(f"output '{path}': found suffix '{path.suffix}', expected {known}")
        if kind == MESH and planes:
            raise typer.BadParameter(f"output '{path}': a mesh needs samples on surfaces; leave out --grid")
        if kind == PICTURE and planes > 1:
            raise typer.BadParameter(f"output '{path}': a picture shows one plane; give --grid once")
    for index, path in enumerate(targets):
        if any(same_file(path, other) for other in targets[:index]):
            raise typer.BadParameter(f"output '{path}': named twice; give every result a file of its own")
    for path in targets:
        check_writable(path)
    keep_inputs(targets, inputs)
    return targets


def keep_inputs(targets: Sequence[Path], inputs: Sequence[str | Path]) -> None:
    """Raise BadParameter if one of the files `targets` is one of `inputs`, which writing would destroy."""
    for path in targets:
        if lost := found_among(path, inputs):
            raise typer.BadParameter(
                f"output '{path}': found '{lost}', which this command reads and writing would destroy; "
                "choose another name"
            )


def check_writable(path: Path) -> None:
    """Raise OSError if the file `path` cannot be written."""
    folder = path.parent
    if not folder.is_dir():
        raise FileNotFoundError(0, "found no such folder; make it first, or choose another", str(folder))
    if path.is_dir():
        raise IsADirectoryError(0, "found a folder, expected the name of a file", str(path))
    if not os.access(folder, os.W_OK):
        raise PermissionError(0, "found a folder that cannot be written to; choose another", str(folder))


def refine_shown(
    session: dl.Session, targets: Sequence[Path], detail: float | str | None, progress: Overall
) -> None:
    """Refine the display mesh at edges of shadows for lit meshes and sessions, to `detail`; None = no."""
    shown = session.samples.display is not None and session.options["gather"] != "off"
    if shown and detail is not None and any(path.suffix.lower() in (MESH, SESSION) for path in targets):
        progress.begin("refine shadows")
        session.refine(detail)


def write_targets(
    session: dl.Session,
    targets: Sequence[Path],
    words: Sequence[str],
    shot: Shot,
    progress: Overall,
) -> None:
    """Write the present state of `session` to each file, by suffix.

    Parameters
    ----------
    session : baked
    targets : see `check_targets`
    words : the command line after "deltalux", which every result states
    shot : settings of pictures
    progress : is notified of each step that begins
    """
    baked = None
    for path in targets:
        suffix = path.suffix.lower()
        if suffix == SESSION:
            session.save(path, command_line(words))
        elif suffix == PICTURE and _per_pixel(session, shot):
            _draw(session, path, words, shot, progress)
        else:
            progress.begin(f"write {suffix}")
            baked = baked or replace(
                baked_of(session, command_line(words), shot.false_colour),
                camera=shot.camera_in(session.scene), size=shot.size, stops=shot.stops,
            )  # fmt: skip
            WRITERS[suffix][1](path, baked)


def write_refined(
    session: dl.Session, targets: Sequence[Path], words: Sequence[str], shot: Shot, progress: Overall
) -> None:
    """Write results after an edit; a mesh that was refined at edges of shadows is refined anew."""
    display = session.samples.display
    refine_shown(session, targets, display.detail_length if display else None, progress)
    write_targets(session, targets, words, shot, progress)


def _per_pixel(session: dl.Session, shot: Shot) -> bool:
    """Whether pixels can have their own light: not with planes or discs, nor if memory is short."""
    options = session.options
    gathers = session.samples.display is not None and options["gather"] != "off"
    return gathers and fits(shot.size, options["memory_limit"])


def _draw(session: dl.Session, path: Path, words: Sequence[str], shot: Shot, progress: Overall) -> None:
    """Write a picture with light per pixel; sample values are too coarse for shadows."""
    progress.begin("view")
    edges_known = edges_into(progress, in_pixels(counts_of_session(session), shot.size))
    rendering = render_session(
        session, camera=shot.camera_in(session.scene), size=shot.size, keep=False, edges_known=edges_known
    )
    progress.begin("finish picture")
    picture = shot.picture_of(rendering)
    about = about_text(session.result) | {"command": command_line(words), "gathered": rendering.gathered}
    progress.begin(f"write {PICTURE}")
    replace(picture, about=about).save(path)


def command_line(words: Sequence[str]) -> str:
    """Return the full command of which `words` follow "deltalux"."""
    return shlex.join(["deltalux", *words])
