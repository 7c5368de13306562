# SPDX-License-Identifier: Apache-2.0
"""Takes pictures of the page in each of its important states, sizes and themes, to be looked at.

PYTHONPATH=python:tests python tools/viewer_pictures.py build/pictures
PYTHONPATH=python:tests python tools/viewer_pictures.py build/pictures --states error --sizes 800x600
"""

from __future__ import annotations

import argparse
import sys
import tempfile
from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import Any, NamedTuple

import deltalux as dl
from deltalux.scene import replace_scene
from deltalux.server.serving import Server
from viewer.page import many_lamps
from viewer.page.browsers import launched
from viewer.page.driver import Viewer
from viewer.served_room import saved

SIZES = {"1280x800": (1280, 800), "800x600": (800, 600), "400x800": (400, 800)}
THEMES = ("dark", "light")
WINDOW = {"width": 1280, "height": 800}
BAKE = 300.0  # seconds that a bake has
AWAY = "WebSocket connection to"  # what the browser complains of without its server


class Shown(NamedTuple):
    """A page, and the server behind it."""

    viewer: Viewer
    server: Server


def office() -> dl.Session:
    """The bundled office."""
    return dl.Session(dl.scenes.office(), paths=200_000, gather=128)


def unbaked_office() -> dl.Session:
    """The office, of so many paths that its bake takes a while."""
    return dl.Session(dl.scenes.office(), paths=4_000_000, gather=128)


def dark_office() -> dl.Session:
    """The office without lamps."""
    scene = dl.scenes.office()
    dark = [dl.Material(m.name, m.reflectance) if m.emissive else m for m in scene.materials]
    scene = replace_scene(scene, materials=dark, lights=())
    return dl.Session(scene, paths=20_000, gather="off")


def open_panels(viewer: Viewer) -> None:
    """Open the drawer, if the window is so small that there is one."""
    drawer = viewer.button("Panels")
    if drawer.is_visible() and drawer.get_attribute("aria-expanded") == "false":
        drawer.click()
        viewer.settle()


def start(shown: Shown) -> None:
    """As the page opens."""


def drawer(shown: Shown) -> None:
    """With the panels in sight."""
    open_panels(shown.viewer)


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
    viewer.after(lambda: viewer.drag_arrow("X", (-60, 0)))


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
    open_panels(viewer)
    for value in ("40", "50"):
        field = viewer.page.get_by_label("Position X, m")
        field.fill(value)
        field.press("Enter")
        viewer.settle()
    viewer.page.get_by_label("File name").fill("/tmp/no.glb")
    viewer.button("Export").click()
    viewer.until("document.querySelectorAll('.note').length > 1")


def unfolded(shown: Shown) -> None:
    """Many lamps, one family unfolded."""
    open_panels(shown.viewer)
    shown.viewer.page.locator(".family > summary").first.click()
    shown.viewer.page.locator(".family").first.scroll_into_view_if_needed()


def found(shown: Shown) -> None:
    """Lamps found by a search."""
    open_panels(shown.viewer)
    search = shown.viewer.page.get_by_label("Search lights")
    search.fill("lamp 2")
    search.scroll_into_view_if_needed()


def fixed(shown: Shown) -> None:
    """Something fixed selected, which can be made movable."""
    viewer = shown.viewer
    canvas = viewer.state()["canvas"]
    x, y = viewer.ask("deltalux.project('desk 1')") or (canvas["width"] / 2, canvas["height"] / 2)
    viewer.page.mouse.dblclick(x, y)
    viewer.settle()
    open_panels(viewer)


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
    baked: bool = True


STATES = {
    "start": State(start, office),
    "drawer": State(drawer, office),
    "dragging": State(dragging, office),
    "difference": State(difference, office),
    "false-colour": State(false_colour, office),
    "standard-error": State(standard_error, office),
    "legend": State(legend, office),
    "error": State(error, office),
    "fixed": State(fixed, office),
    "making": State(making, office),
    "made": State(made, office),
    "keys": State(keys, office),
    "away": State(away, office),
    "lamps": State(unfolded, many_lamps.make_session),
    "search": State(found, many_lamps.make_session),
    "dark": State(start, dark_office),
    "lamp": State(lamp, dark_office),
    "preview": State(preview, unbaked_office, baked=False),
}


def files(folder: Path, states: list[str]) -> Iterator[tuple[str, Path | None]]:
    """Each state's session as a file, baked once; None for one that is not baked before."""
    kept: dict[Any, Path] = {}
    for name in states:
        state = STATES[name]
        if state.baked and state.session not in kept:
            kept[state.session] = saved(state.session(), folder / f"{state.session.__qualname__}.{name}.dlx")
        yield name, kept.get(state.session)


def take(browser: Any, file: Path | None, state: State, size: tuple[int, int], theme: str) -> bytes:
    """One picture, as PNG."""
    session = dl.Session.open(file) if file else state.session()
    complaints: list[str] = []
    with session, Server(session, folder=".") as server:
        page = browser.new_page()
        page.set_viewport_size({"width": size[0], "height": size[1]})
        page.emulate_media(color_scheme=theme)
        viewer = Viewer(page, server.url, complaints)
        if file:
            viewer.settle()
        state.reach(Shown(viewer, server))
        picture = page.screenshot()
        page.close()
    if complaints:
        print("  ", *complaints, sep="\n  ")
    return picture


def main() -> int:
    """Parse the command line and take the pictures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    parser.add_argument("--states", nargs="*", choices=STATES, default=list(STATES))
    parser.add_argument("--sizes", nargs="*", choices=SIZES, default=list(SIZES))
    parser.add_argument("--themes", nargs="*", choices=THEMES, default=THEMES)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory() as folder, launched(Path(folder) / "browser", WINDOW) as browser:
        for name, file in files(Path(folder), args.states):
            for size, theme in product(args.sizes, args.themes):
                target = args.folder / f"{name}-{size}-{theme}.png"
                target.write_bytes(take(browser, file, STATES[name], SIZES[size], theme))
                print(target, flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
