# SPDX-License-Identifier: Apache-2.0
"""A page of the viewer in a browser, as tests drive it: real mouse and keys, waiting for conditions."""

from __future__ import annotations

import io
import time
from typing import Any

import numpy as np
from PIL import Image

SECONDS = 30.0  # after which a condition will not come true any more


class Viewer:
    """One page. Conditions are polled from here: its security policy forbids what playwright would do."""

    def __init__(self, page: Any, url: str, complaints: list[str]) -> None:
        self.page = page
        self._complaints, self._expected = complaints, "nothing"
        page.on("console", self._hear)
        page.on("pageerror", lambda error: complaints.append(f"exception: {error}"))
        page.goto(url)
        self.until("!!window.deltalux && deltalux.state().link === 'connected'")

    def _hear(self, message: Any) -> None:
        if message.type in ("error", "warning") and self._expected not in message.text:
            self._complaints.append(f"{message.type}: {message.text}")

    def expect_complaint(self, text: str) -> None:
        """From now on the browser may complain of this."""
        self._expected = text

    def end(self, server: Any) -> None:
        """Leave the page, then stop the server, whose session may then be read."""
        self.page.goto("about:blank")
        server.close()

    def ask(self, expression: str) -> Any:
        """Value of a JavaScript expression."""
        return self.page.evaluate(expression)

    def until(self, expression: str, seconds: float = SECONDS) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + seconds
        while not self.ask(expression):
            if time.monotonic() > end:
                raise AssertionError(f"{expression} did not come true in {self.ask('deltalux.state()')}")
            self.page.wait_for_timeout(20)

    def settle(self) -> None:
        """Wait until the light is up to date and drawn."""
        self.until("deltalux.idle()")

    def after(self, action: Any, expression: str = "true") -> None:
        """Act, then wait for a new revision that is computed and drawn, and for a condition."""
        revision = self.state()["server"]["revision"]
        action()
        self.until(f"deltalux.state().server.revision > {revision} && ({expression})")
        self.settle()

    def state(self) -> dict[str, Any]:
        """What the page knows."""
        return self.ask("deltalux.state()")

    def pose(self, name: str) -> np.ndarray:
        """Pose at which the page draws an object."""
        return np.array(self.state()["poses"][name]).reshape(4, 4).T

    def press(self, key: str) -> None:
        """Press a key."""
        self.page.keyboard.press(key)

    def button(self, name: str) -> Any:
        """The button of that name."""
        return self.page.get_by_role("button", name=name, exact=True)

    def show(self, mode: str) -> None:
        """Change to a view."""
        self.page.locator(f"button[data-mode={mode}]").click()
        self.until(f"deltalux.state().settings.mode === '{mode}' && deltalux.idle()")

    def drag(self, start: tuple[float, float], way: tuple[float, float], steps: int = 6) -> None:
        """Drag with the mouse, on the page."""
        mouse = self.page.mouse
        mouse.move(*start)
        mouse.down()
        for step in range(1, steps + 1):
            mouse.move(start[0] + way[0] * step / steps, start[1] + way[1] * step / steps)
        mouse.up()

    def drag_arrow(self, axis: str, way: tuple[float, float]) -> None:
        """Drag one of the gizmo's arrows."""
        start = self.ask(f"deltalux.gizmoHandle('{axis}')")
        self.page.mouse.move(*start)
        self.until(f"deltalux.gizmoAxis() === '{axis}'")
        self.drag(start, way)

    def touch(self, *ways: tuple[tuple[float, float], tuple[float, float]], steps: int = 8) -> None:
        """Put down one finger per way (start, shift), move them together, and lift them."""
        wire = self.page.context.new_cdp_session(self.page)

        def send(kind: str, share: float) -> None:
            points = [
                {"x": x + share * dx, "y": y + share * dy, "id": k}
                for k, ((x, y), (dx, dy)) in enumerate(ways)
            ]
            wire.send("Input.dispatchTouchEvent", {"type": kind, "touchPoints": points if share < 2 else []})

        send("touchStart", 0)
        for step in range(1, steps + 1):
            send("touchMove", step / steps)
        send("touchEnd", 2)
        wire.detach()

    def touch_button(self, name: str) -> None:
        """Tap a button with a finger."""
        box = self.button(name).bounding_box()
        self.touch(((box["x"] + box["width"] / 2, box["y"] + box["height"] / 2), (0, 0)), steps=0)

    def picture(self) -> np.ndarray:
        """(height, width, 3) pixels of the canvas, without what lies over it."""
        over = "document.querySelectorAll('main > :not(canvas:first-child)')"
        self.ask(f"{over}.forEach((element) => (element.style.visibility = 'hidden'))")
        shot = self.page.locator("main > canvas").first.screenshot()
        self.ask(f"{over}.forEach((element) => (element.style.visibility = ''))")
        return np.asarray(Image.open(io.BytesIO(shot)).convert("RGB")).astype(int)

    def probe(self, x: float, y: float) -> dict[str, Any] | None:
        """What the page reads at a place of the canvas, in pixels."""
        return self.ask(f"deltalux.probe({x}, {y})")

    def places(self, columns: int, rows: int) -> list[tuple[int, int]]:
        """Pixels spread over the canvas."""
        size = self.state()["canvas"]
        xs = np.linspace(0, size["width"], columns + 2)[1:-1].astype(int)
        ys = np.linspace(0, size["height"], rows + 2)[1:-1].astype(int)
        return [(int(x), int(y)) for y in ys for x in xs]
