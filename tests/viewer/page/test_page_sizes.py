# SPDX-License-Identifier: Apache-2.0
"""The page in windows of several sizes, dark and light, with mouse and fingers: nothing covers anything."""

from __future__ import annotations

import pytest

SHOWN = 8  # seconds that each note is shown at least

# Every control that is in the window: inside it, not cut, and what a click at its middle reaches.
UNREACHABLE = """
() => {
  const panels = document.querySelector('aside').getBoundingClientRect()
  const inside = (r, box) => r.left >= box.left - 1 && r.right <= box.right + 1 &&
    r.top >= box.top - 1 && r.bottom <= box.bottom + 1
  const whole = { left: 0, top: 0, right: innerWidth, bottom: innerHeight }
  const wrong = []
  for (const e of document.querySelectorAll('button, select, input, .over > *, .legend, h1, .phase, .note')) {
    if (e.closest('dialog') || !e.checkVisibility()) continue
    const r = e.getBoundingClientRect()
    if (e.closest('aside') && (r.bottom > panels.bottom || r.top < panels.top)) continue  // to be scrolled to
    const name = e.getAttribute('aria-label') || e.textContent || e.className
    if (!inside(r, e.closest('aside') ? panels : whole)) wrong.push(`outside: ${name}`)
    const [x, y] = [(r.left + r.right) / 2, (r.top + r.bottom) / 2]
    const hit = document.elementFromPoint(x, y)
    if (hit && !e.contains(hit) && getComputedStyle(e).pointerEvents !== 'none') {
      wrong.push(`covered: ${name} by ${hit.className || hit.tagName}`)
    }
    if (e.tagName === 'BUTTON' && e.scrollWidth > e.clientWidth + 1) wrong.push(`cut: ${name}`)
  }
  const over = [...document.querySelectorAll('.over > *, .legend, .notes, .progress')]
    .filter((e) => e.checkVisibility() && e.childElementCount + e.textContent.length > 0)
    .map((e) => [e.className, e.getBoundingClientRect()])
  for (const [i, [a, r]] of over.entries()) for (const [b, s] of over.slice(i + 1)) {
    const apart = r.right <= s.left || s.right <= r.left || r.bottom <= s.top || s.bottom <= r.top
    if (!apart && !a.includes(b) && !b.includes(a) && r.width * s.width > 0) wrong.push(`${a} lies over ${b}`)
  }
  return wrong
}
"""


def resize(viewer, size: tuple[int, int]) -> None:
    viewer.page.set_viewport_size({"width": size[0], "height": size[1]})
    viewer.until(f"innerWidth === {size[0]}")
    viewer.until("Math.abs(deltalux.state().canvas.right - document.querySelector('main').clientWidth) < 1")
    viewer.settle()


def refuse(viewer, count: int) -> None:
    """Have the server refuse exports, each with words of its own."""
    ask = "(n) => { document.querySelector('[aria-label=\"File name\"]').value = `/${n}`; send.click() }"
    buttons = "[...document.querySelectorAll('aside button')]"
    viewer.ask(f"window.send = {buttons}.find(({{textContent}}) => textContent === 'Export')")
    for i in range(count):
        viewer.page.evaluate(ask, i)
    viewer.until("document.querySelector('.note') !== null")


@pytest.mark.parametrize("scheme", ["dark", "light"])
@pytest.mark.parametrize("size", [(1280, 800), (800, 600), (400, 800)])
def test_every_control_can_be_reached_at_every_size(viewer, size, scheme):
    viewer.page.emulate_media(color_scheme=scheme)
    resize(viewer, size)
    viewer.show("difference")  # says what it compares with
    refuse(viewer, 3)
    assert viewer.ask(UNREACHABLE) == []
    ground = viewer.ask("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)")
    ink = viewer.ask("getComputedStyle(document.body).color.match(/\\d+/g).map(Number)")
    assert (min(ground) > 200 and max(ink) < 60) == (scheme == "light")
    canvas = viewer.state()["canvas"]
    assert canvas["width"] * canvas["height"] > 0.45 * size[0] * size[1]


@pytest.mark.parametrize("scheme", ["dark", "light"])
def test_sliders_stand_out_from_their_ground(viewer, scheme):
    """Browsers draw the rest of a track nearly black on a light page, if the slider itself is bright."""
    viewer.page.emulate_media(color_scheme=scheme)
    colour = (
        "getComputedStyle(document.querySelector('input[type=range]')).accentColor.match(/\\d+/g).map(Number)"
    )
    red, green, blue = viewer.ask(colour)
    luminance = 0.2126 * red + 0.7152 * green + 0.0722 * blue
    assert (luminance < 128) == (scheme == "light")


def test_phone_has_its_panels_in_a_drawer_and_keeps_the_picture_in_sight(viewer):
    resize(viewer, (400, 800))
    panels, slider = viewer.page.locator("aside"), viewer.page.get_by_label("Light of left", exact=True)
    assert panels.is_hidden()
    whole = viewer.state()["canvas"]
    viewer.touch_button("Panels")
    panels.wait_for()
    viewer.until(f"deltalux.state().canvas.height < {whole['height']} && deltalux.idle()")
    canvas, drawer = viewer.state()["canvas"], panels.bounding_box()
    assert canvas["bottom"] <= drawer["y"] and canvas["height"] > 200
    assert viewer.ask(UNREACHABLE) == []
    slider.scroll_into_view_if_needed()
    box = slider.bounding_box()
    start = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    viewer.after(
        lambda: viewer.touch((start, (-60, 0))), "deltalux.state().server.undo !== null"
    )  # by a finger
    assert viewer.state()["server"]["factors"]["left"] < 0.9
    viewer.touch_button("Panels")
    panels.wait_for(state="hidden")


def test_upright_picture_shows_what_the_wide_one_does(viewer):
    """The camera's angle is that of the shorter side."""
    field = viewer.state()["camera"]["fov"]
    resize(viewer, (400, 800))
    viewer.until(f"deltalux.state().camera.fov > {field}")  # the page hears of its size later than the test
    viewer.settle()
    for name in ("crate", "post"):
        x, y = viewer.ask(f"deltalux.project('{name}')")
        canvas = viewer.state()["canvas"]
        assert canvas["left"] < x < canvas["right"] and canvas["top"] < y < canvas["bottom"]
    start = tuple(viewer.ask("deltalux.project('post')"))
    viewer.after(lambda: viewer.touch((start, (-20, 10))), "deltalux.state().server.undo !== null")
    assert viewer.state()["selected"] == "post"


def test_notes_wait_for_their_turn_and_can_be_closed(viewer):
    refuse(viewer, 5)
    viewer.until("document.querySelectorAll('.note').length === 3")
    notes, more = viewer.page.locator(".note"), viewer.page.locator(".notes > button")
    viewer.until("document.querySelector('.notes > button').textContent === '2 more, close all'")
    assert "'/0.glb'" in notes.nth(0).inner_text()
    notes.nth(0).get_by_role("button").click()
    assert [f"'/{i}.glb'" in notes.nth(i - 1).inner_text() for i in (1, 2, 3)] == [True] * 3
    assert more.inner_text() == "1 more, close all"
    more.click()
    assert notes.count() == 0 and more.is_hidden()


def test_errors_stay_until_others_need_the_room(viewer):
    """A note of another kind goes by itself."""
    refuse(viewer, 3)
    notes = viewer.page.locator(".note")
    viewer.page.wait_for_timeout(1000 * SHOWN + 500)
    assert [f"'/{i}.glb'" in notes.nth(i).inner_text() for i in range(3)] == [True] * 3
    refuse(viewer, 5)  # the first three are said again, and are not old then
    viewer.until("document.querySelector('.notes > button').textContent === '2 more, close all'")
    viewer.until("document.querySelector('.notes > button').hidden", 20)
    assert notes.count() == 3
    assert [f"'/{i}.glb'" in notes.nth(i - 2).inner_text() for i in (2, 3, 4)] == [True] * 3
