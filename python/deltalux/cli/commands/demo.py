# SPDX-License-Identifier: Apache-2.0
"""`deltalux demo`: bake the bundled atrium, move its trolley, show that the update is exact and fast."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer

import deltalux as dl
from deltalux.cli.baking import figures, summary_table, total_milliseconds
from deltalux.cli.console import Terminal
from deltalux.cli.edits import moved_pose
from deltalux.cli.options import (
    CameraOption,
    ExposureOption,
    EyeOption,
    JsonOption,
    Move,
    PathsOption,
    QuietOption,
    SeedOption,
    SizeOption,
    TargetOption,
    ThreadsOption,
)
from deltalux.cli.shots import Shot, shot_of
from deltalux.cli.targets import check_writable, command_line
from deltalux.files import written_aside
from deltalux.mesh.display_mesh import DisplayMesh
from deltalux.outputs.images import Picture, difference, render, side_by_side
from deltalux.outputs.of_session import baked_of
from deltalux.outputs.vertex_colors import write_glb
from deltalux.report import Section, page

TROLLEY = "trolley"
MOVE = Move(TROLLEY, (4.0, 0.0, -1.5), 0.0)
PICTURES = ("before", "after", "difference", "false_colour", "overview")

FolderOption = Annotated[
    Path,
    typer.Option("-o", "--output", metavar="DIR", help="Folder for the pictures, the mesh and the report."),
]


@dataclass(frozen=True)
class Times:
    """Milliseconds of the three computations."""

    bake: float
    update: float
    recompute: float

    @property
    def speed_up(self) -> float:
        """Ratio of the recomputation's time to the update's."""
        return self.recompute / self.update


def run(
    context: typer.Context,
    output: FolderOption = Path("demo-output"),
    paths: PathsOption = None,
    seed: SeedOption = 1,
    threads: ThreadsOption = None,
    camera: CameraOption = None,
    eye: EyeOption = None,
    target: TargetOption = None,
    size: SizeOption = None,
    exposure: ExposureOption = 0.0,
    as_json: JsonOption = False,
    quiet: QuietOption = False,
) -> None:
    """Bake the bundled atrium, move its trolley, write pictures, a lit mesh and a report.

    Then everything is computed again from scratch: the two digests must be the same.

    [bold]Example[/]

    deltalux demo -o /tmp/demo
    """
    files = {name: output / f"{name}.png" for name in PICTURES}
    shot = shot_of(camera, eye, target, size, exposure, targets=list(files.values()))
    output.mkdir(parents=True, exist_ok=True)
    check_writable(output / "report.html")
    mesh = output / "atrium_lit.glb"
    terminal = Terminal(as_json, quiet)
    with terminal.progress() as progress:
        scene = dl.scenes.atrium()
        shot.camera_in(scene)
        session = dl.Session(scene, paths=paths, seed=seed, threads=threads, progress=progress)
        with session:
            bake = session.bake()
            before, irradiance = _picture(session, shot, threads, stops=shot.stops), session.irradiance
            session.move(TROLLEY, moved_pose(session.pose(TROLLEY), MOVE))
            frame = session.update()
            updated, data = session.digest(), figures(session, frame)
            pictures = _pictures(session, before, irradiance, shot, threads)
            write_glb(mesh, baked_of(session, command_line(context.obj)))
            again = session.recompute()
            recomputed = session.digest()
    times = Times(*(total_milliseconds(f) for f in (bake, frame, again)))
    for name, picture in pictures.items():
        picture.save(files[name])
    same = updated == recomputed
    sentences = _sentences(scene, data, frame, times, updated, recomputed)
    report = _report(sentences, data, files)
    with written_aside(output / "report.html") as file:
        file.write(report.encode())
    data |= {
        "bake_milliseconds": times.bake,
        "update_milliseconds": times.update,
        "recompute_milliseconds": times.recompute,
        "speed_up": times.speed_up,
        "same_digest": same,
        "outputs": [str(path) for path in (*files.values(), mesh, output / "report.html")],
    }
    written = f"pictures, a lit mesh and report.html are in {output}"
    invitation = f"drag the trolley yourself: {_program()} view atrium"
    table = summary_table("atrium", data)
    terminal.result(data, table, *sentences, written, invitation)
    if not same:
        raise dl.Error(
            f"update and recompute differ: found digest {updated} after the update, expected {recomputed} "
            "as from scratch; please report this with your processor and Embree version"
        )


def _program() -> str:
    """Return the command that started this program, which may not be on the search path."""
    called = sys.argv[0]
    return called if Path(called).name == "deltalux" else "deltalux"


def _mesh(session: dl.Session) -> DisplayMesh:
    display = session.samples.display
    assert display is not None  # the demo's samples are on vertices
    return display


def _picture(session: dl.Session, shot: Shot, threads: int | None, **options: Any) -> Picture:
    """Draw the session's present state."""
    options = {"camera": shot.camera_in(session.scene), **options}
    options |= {"poses": session.poses, "size": shot.size, "threads": threads or 0}
    return render(session.scene, _mesh(session), session.irradiance, **options)


def _pictures(
    session: dl.Session, before: Picture, irradiance: np.ndarray, shot: Shot, threads: int | None
) -> dict[str, Picture]:
    """Draw the report's pictures, all with the camera of the picture `before`.

    Parameters
    ----------
    session : after the move
    before, irradiance : picture and values before the move
    """
    camera = before.camera
    after = _picture(session, shot, threads, camera=camera, exposure=before.exposure)
    options: dict[str, Any] = {
        "poses": session.poses,
        "camera": camera,
        "size": shot.size,
        "threads": threads or 0,
    }
    change = difference(session.scene, _mesh(session), irradiance, session.irradiance, **options)
    return {
        "before": before,
        "after": after,
        "difference": change,
        "false_colour": _picture(session, shot, threads, camera=camera, false_colour=True),
        "overview": side_by_side([before, after, change], ["before", "after", "difference"]),
    }


def _sentences(
    scene: dl.Scene, data: dict[str, Any], frame: dl.Frame, times: Times, updated: str, recomputed: str
) -> list[str]:
    """Describe what was done, how long it took, and whether update and recompute agree."""
    x, _, z = MOVE.offset
    verdict = (
        f"update and recompute have the same digest: {updated}"
        if updated == recomputed
        else f"update and recompute DIFFER: {updated} and {recomputed}"
    )
    return [
        f"bake: {scene.info()['triangles']:,} triangles, {data['samples']:,} samples, "
        f"{data['paths']:,} paths in {times.bake / 1000:.1f} s",
        f"update: trolley moved by ({x:g}, {z:g}) m; {frame.affected_paths:,} paths "
        f"({frame.affected_paths / data['paths']:.1%}) traced again in {times.update:.1f} ms",
        f"speed-up: {times.speed_up:,.0f} times faster than recomputing, {times.recompute:,.0f} ms",
        verdict,
    ]


def _report(sentences: list[str], data: dict[str, Any], files: dict[str, Path]) -> str:
    header = ("samples of", "count", f"minimum ({data['unit']})", "mean", "maximum", "uniformity")
    rows = [
        (s["name"], s["samples"], s["minimum"], s["mean"], s["maximum"], s["uniformity"])
        for s in data["sets"]
    ]
    stages = [(stage, value) for stage, value in data["milliseconds"].items()]
    shown = (("before", "Before"), ("after", "After the trolley moved"), ("difference", "After minus before"))
    return page(
        "Deltalux: the atrium's trolley moved",
        [
            Section("What happened", paragraphs=sentences),
            Section("Pictures", pictures=[(files[name], caption) for name, caption in shown]),
            Section(
                "Illuminance", header=header, rows=rows, pictures=[(files["false_colour"], "Illuminance")]
            ),
            Section("The update, stage by stage", header=("stage", "milliseconds"), rows=stages),
        ],
    )
