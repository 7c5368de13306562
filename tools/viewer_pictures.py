# SPDX-License-Identifier: Apache-2.0
"""Takes pictures of the page in each of its important states, sizes and themes, to be looked at.

export PYTHONPATH=python:tests:tests/python
python tools/viewer_pictures.py build/pictures
python tools/viewer_pictures.py build/pictures --states error --sizes 800x600
python tools/viewer_pictures.py build/pictures --states start difference --scene expo
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import deltalux as dl
from deltalux.scene import replace_scene
from deltalux.server.web.serving import Server
from viewer.page import many_lamps
from viewer.page.browsers import launched
from viewer.page.driver import Viewer
from viewer.served_room import saved

SIZES = {"1280x800": (1280, 800), "800x600": (800, 600), "400x800": (400, 800)}
THEMES = ("dark", "light")
SPACING = 0.12  # metres
WINDOW = {"width": 1280, "height": 800}
SETTLED = 1500  # milliseconds
BAKE = 300.0  # seconds that a bake has
AWAY = "WebSocket connection to"  # what the browser complains of without its server


class Shown(NamedTuple):
    """A page, and the server behind it."""

    viewer: Viewer
    server: Server


def office() -> dl.Session:
    """The bundled office, with as few samples as are good for pictures."""
    scene = dl.scenes.office()
    return dl.Session(scene, dl.Samples.on_vertices(scene, spacing=SPACING), paths=200_000, gather=64)


def unbaked_office() -> dl.Session:
    """The office, of so many paths that its bake takes a while."""
    return dl.Session(dl.scenes.office(), paths=4_000_000, gather=128)


def dark_office() -> dl.Session:
    """The office without lamps."""
    scene = dl.scenes.office()
    dark = [dl.Material(m.name, m.reflectance) if m.emissive else m for m in scene.materials]
    scene = replace_scene(scene, materials=dark, lights=())
    return dl.Session(scene, paths=20_000, gather="off")


def open_panels(viewer: Viewer, panel: str) -> None:
    """Bring a panel into sight; the drawer is opened, if the window is so small that there is one."""
    drawer = viewer.button("Panels")
    if drawer.is_visible() and drawer.get_attribute("aria-expanded") == "false":
        drawer.click()
        viewer.until("deltalux.still()")
    if not viewer.page.locator("aside").is_visible():
        return
    viewer.page.locator(".panel > summary", has_text=panel).scroll_into_view_if_needed()


def start(shown: Shown) -> None:
    """As the page opens."""


def dragging(shown: Shown) -> None:
    """In the middle of a drag."""
    viewer = shown.viewer
    x, y = viewer.ask("deltalux.gizmoHandle('X')")
    viewer.page.mouse.move(x, y)
    viewer.until("deltalux.gizmoAxis() === 'X'")
    viewer.page.mouse.down()
    for step in range(1, 6):
        viewer.page.mouse.move(x - 10 * step, y)
    viewer.until("!deltalux.state().server || deltalux.state().frame?.done > 0")


def dragged(viewer: Viewer) -> None:
    """Drag the chair by its arrow."""
    viewer.drag_arrow("X", (-60, 0))
    viewer.until("deltalux.state().server.undo !== null && deltalux.idle()", BAKE)


def difference(shown: Shown) -> None:
    """What a move changed."""
    dragged(shown.viewer)
    shown.viewer.show("difference")


def false_colour(shown: Shown) -> None:
    """Illuminance with isolines and a pin."""
    viewer = shown.viewer
    viewer.show("falseColour")
    viewer.press("i")
    viewer.settle()
    canvas = viewer.state()["canvas"]
    viewer.page.mouse.click(canvas["left"] + canvas["width"] * 0.3, canvas["top"] + canvas["height"] * 0.8)
    viewer.settle()


def standard_error(shown: Shown) -> None:
    """How sure the values are."""
    shown.viewer.show("error")


def legend(shown: Shown) -> None:
    """A range being typed into the legend."""
    viewer = shown.viewer
    viewer.show("falseColour")
    field = viewer.page.get_by_label("Upper end of the colours")
    field.fill("1200")
    field.press("Enter")
    viewer.settle()
    field.focus()


def error(shown: Shown) -> None:
    """Edits and exports that the server refuses."""
    viewer = shown.viewer
    viewer.ask("void (window.setTimeout = () => 0)")  # notes stay
    for value in ("40", "50"):
        field = viewer.page.get_by_label("Position X, m")
        field.fill(value)
        field.press("Enter")
        viewer.settle()
    viewer.page.get_by_label("File name").fill("/tmp/no.glb")
    viewer.button("Export").click()
    viewer.until("document.querySelectorAll('.note').length > 0")


def unfolded(shown: Shown) -> None:
    """Many lamps, one family unfolded."""
    shown.viewer.page.locator(".family > summary").first.click()


def found(shown: Shown) -> None:
    """Lamps found by a search."""
    shown.viewer.page.get_by_label("Search lights").fill("lamp 2")


def fixed(shown: Shown) -> None:
    """Something fixed selected, which can be made movable."""
    viewer = shown.viewer
    canvas = viewer.state()["canvas"]
    x, y = viewer.ask("deltalux.project('desk 1')") or (canvas["width"] / 2, canvas["height"] / 2)
    viewer.page.mouse.dblclick(x, y)
    viewer.settle()


def making(shown: Shown) -> None:
    """The bake that makes it movable at work."""
    fixed(shown)
    shown.viewer.button("Make movable").click()
    shown.viewer.page.locator(".progress").wait_for()


def made(shown: Shown) -> None:
    """After it."""
    making(shown)
    shown.viewer.until("deltalux.state().server.phase === 'ready' && deltalux.idle()", BAKE)


def lamp(shown: Shown) -> None:
    """After the offered lamp was taken."""
    shown.viewer.button("Add a lamp").click()
    shown.viewer.until("deltalux.state().server.factors.lamp === 1 && deltalux.idle()", BAKE)


def preview(shown: Shown) -> None:
    """A preview of the first bake."""
    shown.viewer.until("deltalux.state().preview", BAKE)


def away(shown: Shown) -> None:
    """The server is gone."""
    shown.viewer.expect_complaint(AWAY)
    shown.server.close()
    shown.viewer.until("deltalux.state().link === 'lost'")


def keys(shown: Shown) -> None:
    """The list of keys."""
    shown.viewer.press("?")


class State(NamedTuple):
    """Something that the page can show, and how to get there."""

    reach: Callable[[Shown], None]
    session: Callable[[], dl.Session]
    panel: str = ""  # whose controls matter
    baked: bool = True
    numbered: bool = False  # its isolines get numbers


STATES = {
    "start": State(start, office),
    "dragging": State(dragging, office),
    "difference": State(difference, office, "View"),
    "false-colour": State(false_colour, office, numbered=True),
    "standard-error": State(standard_error, office),
    "legend": State(legend, office),
    "error": State(error, office, "Object"),
    "fixed": State(fixed, office, "Object"),
    "making": State(making, office),
    "made": State(made, office, "Object"),
    "keys": State(keys, office),
    "away": State(away, office),
    "lamps": State(unfolded, many_lamps.make_session, "Lights"),
    "search": State(found, many_lamps.make_session, "Lights"),
    "dark": State(start, dark_office),
    "lamp": State(lamp, dark_office),
    "preview": State(preview, unbaked_office, baked=False),
}


def with_scene(state: State, scene: str) -> State:
    """The state in another bundled scene, as it is baked by default, in place of the office."""

    def session() -> dl.Session:
        return dl.Session(getattr(dl.scenes, scene)())

    session.__name__ = scene
    return state._replace(session=session) if scene and state.session is office else state


def files(folder: Path, states: dict[str, State]) -> Iterator[tuple[str, Path | None]]:
    """Each state's session as a file, baked unless it is there; None for one that is not baked before."""
    for name, state in states.items():
        path = folder / f"{state.session.__module__}.{state.session.__name__}.dlx"
        if state.baked and not path.exists():
            saved(state.session(), path)
        yield name, path if state.baked else None


def take(browser: Any, file: Path | None, state: State, looks: Sequence[tuple[str, str]]) -> Iterator[bytes]:
    """A picture, as PNG, in each of these sizes and themes."""
    session = dl.Session.open(file) if file else state.session()
    complaints: list[str] = []
    with session, Server(session, folder=".") as server:
        page = browser.new_page()
        viewer = Viewer(page, server.url, complaints)
        if file:
            viewer.until("deltalux.idle()", BAKE)
        state.reach(Shown(viewer, server))
        for size, theme in looks:
            width, height = SIZES[size]
            page.set_viewport_size({"width": width, "height": height})
            page.emulate_media(color_scheme=theme)
            viewer.until(f"innerWidth === {width} && deltalux.still()", BAKE)
            if state.panel:
                open_panels(viewer, state.panel)
            page.wait_for_timeout(SETTLED)
            if state.numbered:  # which comes once the picture rests
                viewer.until("deltalux.state().isolineLabels.length > 0", BAKE)
            yield page.screenshot(timeout=1000 * BAKE)
        page.close()
    if complaints:
        print("  complaints:", *complaints, sep="\n  ")


def main() -> int:
    """Parse the command line and take the pictures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--states", nargs="*", choices=STATES, default=list(STATES))
    parser.add_argument("--sizes", nargs="*", choices=SIZES, default=list(SIZES))
    parser.add_argument("--themes", nargs="*", choices=THEMES, default=THEMES)
    parser.add_argument("--scene", help="a bundled one, in place of a quick office", default="")
    parser.add_argument("--sessions", type=Path, help="folder that keeps what was baked for the next time")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    if args.sessions:
        args.sessions.mkdir(parents=True, exist_ok=True)
    looks = list(product(args.sizes, args.themes))
    states = {name: with_scene(STATES[name], args.scene) for name in args.states}
    with tempfile.TemporaryDirectory() as folder, launched(Path(folder) / "browser", WINDOW) as browser:
        for name, file in files(args.sessions or Path(folder), states):
            for look, picture in zip(looks, take(browser, file, states[name], looks), strict=True):
                target = args.folder / f"{'-'.join((*filter(None, [args.scene]), name, *look))}.png"
                target.write_bytes(picture)
                print(target, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
