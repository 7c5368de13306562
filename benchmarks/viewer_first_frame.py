# SPDX-License-Identifier: Apache-2.0
"""From the address to the first lit picture of the viewer's page, part by part; and what a picture costs.

    export PYTHONPATH=python:tests:tests/python
    python benchmarks/viewer_first_frame.py atrium.dlx
    python benchmarks/viewer_first_frame.py --divided 3 office

Sessions are baked before; a bundled scene's name with `--divided N` is baked here, by few paths, after each
of its triangles was divided by four N times. The least of some runs, in milliseconds, of a Chromium without a
graphics card. `bytes` went over the wire; `call` is what a picture takes of the page's own processor time,
drawn on but not waited for. Writes benchmarks/out/viewer_first_frame.json.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

import deltalux as dl
import numpy as np
from deltalux.scene import replace_scene
from deltalux.server.web.serving import Server
from viewer.page.browsers import launched
from viewer.page.driver import Viewer

OUT = Path(__file__).resolve().parent / "out" / "viewer_first_frame.json"
WINDOW = {"width": 1280, "height": 800}
WAIT = 600.0  # seconds that a page has
PARTS = {
    "script": "page and script",
    "scene": "description",
    "geometry": "geometry over the wire",
    "built": "page and geometry made",
    "values": "light over the wire",
    "submitted": "drawing called",
    "lit": "drawn",
}
CALL = """() => {
  const times = []
  for (let i = 0; i < 20; i++) {
    const start = performance.now()
    deltalux.cost()
    times.push(performance.now() - start)
  }
  return times.sort((a, b) => a - b)[10]
}"""
ENTRIES = """() => ({
  marks: Object.fromEntries(performance.getEntriesByType('mark').map((m) => [m.name, m.startTime])),
  bytes: Object.fromEntries(performance.getEntriesByType('resource').map(
    (r) => [new URL(r.name).pathname.split('/').pop(), r.transferSize])),
})"""
PROBE = """() => {
  const { width, height } = deltalux.state().canvas
  const start = performance.now()
  deltalux.probe(width / 2, height / 2)
  return performance.now() - start
}"""


def divided(scene: dl.Scene, times: int) -> dl.Scene:
    """The scene with each triangle divided by four, so many times."""

    def quarters(mesh: dl.Mesh) -> dl.Mesh:
        a, b, c = mesh.vertices[mesh.triangles].transpose(1, 0, 2)
        ab, bc, ca = (a + b) / 2, (b + c) / 2, (c + a) / 2
        parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
        corners = np.concatenate([np.stack(part, axis=1) for part in parts])
        vertices, triangles = np.unique(corners.reshape(-1, 3), axis=0, return_inverse=True)
        material = np.tile(mesh.material_index, 4)
        return replace(mesh, vertices=vertices, triangles=triangles.reshape(-1, 3), material_index=material)

    for _ in range(times):
        scene = replace_scene(scene, meshes=[quarters(mesh) for mesh in scene.meshes])
    return scene


def session_of(source: str, times: int) -> dl.Session:
    """A stored session, or a bundled scene, baked with little light."""
    if source.endswith(".dlx"):
        return dl.Session.open(source)
    scene = divided(getattr(dl.scenes, source)(), times)
    session = dl.Session(scene, dl.Samples.on_vertices(scene), paths=20_000, gather="off")
    session.bake()
    return session


def one_run(browser: Any, url: str) -> dict[str, Any]:
    """Marks, bytes and costs of one page."""
    complaints: list[str] = []
    page = browser.new_page()
    viewer = Viewer(page, url, complaints)
    viewer.until("deltalux.idle()", WAIT)
    found = viewer.page.evaluate(ENTRIES)
    found |= {
        "cost": viewer.ask("deltalux.cost()"),
        "call": page.evaluate(CALL),
        "pick": page.evaluate(PROBE),
    }
    page.close()
    if complaints:
        raise SystemExit("\n".join(complaints))
    return found


def report(runs: list[dict[str, Any]]) -> dict[str, Any]:
    """The parts of the quickest run."""
    best = min(runs, key=lambda run: run["marks"]["lit"])
    ends = [0.0, *(best["marks"][name] for name in PARTS)]
    return {
        "total": ends[-1],
        "parts": {
            title: end - begin for title, (begin, end) in zip(PARTS.values(), pairwise(ends), strict=True)
        },
        "bytes": best["bytes"],
        "calls": best["cost"]["calls"],
        "call": min(run["call"] for run in runs),
        "pick": min(run["pick"] for run in runs),
    }


def main() -> int:
    """Parse the command line and run."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("source")
    parser.add_argument("--divided", type=int, default=0)
    parser.add_argument("--runs", type=int, default=3)
    args = parser.parse_args()
    with session_of(args.source, args.divided) as session, tempfile.TemporaryDirectory() as folder:
        with Server(session) as server, launched(Path(folder), WINDOW) as browser:
            runs = [one_run(browser, server.url) for _ in range(args.runs)]
        display = session.samples.display
        assert display is not None
        about = {
            "triangles": len(display.triangles),
            "vertices": len(display.points),
            "load": os.getloadavg()[0],
        }
        found = about | report(runs)
    OUT.parent.mkdir(exist_ok=True)
    OUT.write_text(json.dumps(found, indent=1))
    print(json.dumps(found, indent=1))
    return 0


if __name__ == "__main__":
    sys.exit(main())
