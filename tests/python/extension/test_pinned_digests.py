# SPDX-License-Identifier: Apache-2.0
"""Equal seeds give the bits that they gave before: digests of six sessions, as they were written down.

That updates equal recomputes says nothing of changes that both take part in. Which bits there are depends on
what `build` names, so each build has values of its own in `pinned_digests.json`; where the present one has
none, two threads must give those of one. Pin anew after a change that is meant to change results, and on
another machine before any, and commit the file:

    DELTALUX_PIN=1 PYTHONPATH=python .venv/bin/pytest -n 0 tests/python/extension/test_pinned_digests.py

After such a change the values of other builds are of the past: `DELTALUX_PIN=only` removes them.
"""

from __future__ import annotations

import hashlib
import json
import os
import platform
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from deltalux import _core
from deltalux.scene import replace_scene
from rooms import box, translation, turn

PINNED = Path(__file__).with_name("pinned_digests.json")
PIN = os.environ.get("DELTALUX_PIN", "")
FULL = {"paths": 20_000, "gather": 32, "seed": 7}


@cache
def build() -> str:
    """What bits depend on besides the code: the session file's words for it, and who reckons sines."""
    return f"{_core.description()}; {' '.join(platform.libc_ver())}; numpy {np.__version__}"


def lamps() -> dl.Scene:
    """The Cornell box with lamps of each kind, at rest and carried along."""
    down, strong = (0.1, -1, 0.2), (30, 20, 10)
    return replace_scene(
        dl.scenes.cornell_box(),
        lights=[
            dl.PointLight("bulb", (1.5, 2.5, 1.9), (3, 4, 5)),
            dl.PointLight("tied bulb", (0, 3.7, 0), (2, 1, 1), "tied", "tall_block"),
            dl.SpotLight("flood", (-2, 4, 1), (0.5, -1, 0), (8, 6, 4), 0.0, 1.3),
            dl.SpotLight("narrow", (2, 5, -1), down, strong, 0.1, 0.2, "tied"),
            dl.SpotLight("tied spot", (0.3, 2.9, 0), down, strong, 0.2, 0.5, "tied", "short_block"),
            dl.SunLight("sun", (0.3, -0.5, -1), (9, 8, 7)),
            dl.SunLight("tied sun", (-0.2, -0.3, -1), (2, 3, 4), "tied", "short_block"),
        ],
    )


@dataclass(frozen=True)
class Case:
    """A scene, what its edits are about, and how its session is made."""

    make: Callable[[], dl.Scene]
    material: str  # painted
    lamp: str  # luminous, of a group of its own
    at: tuple[float, float, float]  # where a mesh of that is put
    options: dict = field(default_factory=dict)


CASES = {
    "cornell box": Case(dl.scenes.cornell_box, "red", "lamp", (1.6, 3.0, 0.5)),
    "office": Case(dl.scenes.office, "carpet", "bulb", (1.5, 1.5, 1.2)),
    "atrium": Case(lambda: dl.scenes.atrium(0.5, sun=True), "stucco", "globe_ground", (1.5, 1.5, 1.2)),
    "expo": Case(dl.scenes.expo, "hall_wall", "panel_lamp", (1.5, 1.5, 1.2)),
    "lamps by rays": Case(lamps, "white", "lamp", (1.6, 3.0, 0.5), {"direct": "sampled"}),
    "lamps by paths": Case(lamps, "green", "lamp", (1.6, 3.0, 0.5), {"direct": "paths", "gather": "off"}),
}


def samples_of(scene: dl.Scene, most: int = 60) -> dl.Samples:
    """At middles of triangles of each mesh, spread over their numbers; attached where the mesh can move."""
    found = []
    per_mesh = max(3, 4 * most // len(scene.meshes))
    for mesh in scene.meshes:
        chosen = np.linspace(0, len(mesh.triangles) - 1, min(per_mesh, len(mesh.triangles))).astype(int)
        corners = (mesh.vertices if mesh.movable else mesh.world_vertices)[mesh.triangles[chosen]]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        name = mesh.name if mesh.movable else None
        found.append(dl.Samples(corners.mean(axis=1), normals, 0.3, attached_to=name))
    return dl.Samples.concatenate(found)


def edits(session: dl.Session, case: Case) -> Iterator[None]:
    """Queue twenty edits, one at a time."""
    first, *_, last = session.scene.movable * 2
    start = {name: session.pose(name) for name in (first, last)}
    group, other, *_ = tuple(session.scene.groups) * 2
    reflectance = session.scene.material(case.material).reflectance
    crate = dl.Mesh("crate", *box((0.3, 0.2, 0.4)), case.lamp, pose=translation(*case.at), movable=True)

    yield session.move(first, translation(0.25, 0.05, 0.1) @ start[first])
    yield session.dim(group, 0.5)
    yield session.move(last, start[last] @ turn(0.7))
    yield session.set_reflectance(case.material, (0.2, 0.6, 0.4))
    yield session.remove(first)
    yield session.dim(other, 1.75)
    yield session.move(last, translation(-0.2, 0.1, 0.15) @ start[last] @ turn(0.2))
    yield session.add(first)
    yield session.add(crate)
    yield session.move("crate", translation(*case.at) @ turn(1.1))
    yield session.set_reflectance(case.material, (0.7, 0.1, 0.3))
    yield session.remove(last)
    yield session.move(first, start[first])
    yield session.dim(group, 0.0)
    yield session.add(last)
    yield session.dim(group, 1.0)
    yield session.remove("crate")
    yield session.set_reflectance(case.material, reflectance)
    yield session.move(last, start[last])
    yield session.add("crate")


def state(session: dl.Session) -> list[str]:
    """The digest, and one of what is read: irradiance, standard errors, and light at other places."""
    points = np.linspace((-1, 0.8, -1), (1, 1.4, 1), 5)
    read = hashlib.sha256()
    for values in (*session.read(), session.at(points, (0, 1, 0))):
        read.update(np.ascontiguousarray(values).tobytes())
    return [session.digest(), read.hexdigest()[:32]]


def found_in(case: Case, path: Path, threads: int = 2) -> dict[str, list[str]]:
    """Digests of a session after its bake and after its edits; it is saved and opened on the way."""
    scene = case.make()
    options = FULL | case.options
    with dl.Session(scene, samples_of(scene), threads=threads, **options) as session:
        session.bake()
        found = {"baked": state(session)}
        count = 0
        for _ in edits(session, case):
            session.update()
            count += 1
        assert count == 20
        found["edited"] = state(session)
        session.save(path)
    with dl.Session.open(path) as opened:
        assert state(opened) == found["edited"]
        opened.recompute()
        assert opened.digest() == found["edited"][0]
    return found


@pytest.mark.parametrize("name", CASES)
def test_equal_seeds_give_the_bits_that_they_gave(name: str, tmp_path: Path) -> None:
    everything = json.loads(PINNED.read_text()) if PINNED.exists() else {}
    mine = everything.get(build(), {})
    found = found_in(CASES[name], tmp_path / "session.dlx")
    if PIN:
        kept = {} if PIN == "only" else everything
        PINNED.write_text(json.dumps(kept | {build(): mine | {name: found}}, indent=1, sort_keys=True) + "\n")
        return
    expected = mine.get(name) or found_in(CASES[name], tmp_path / "again.dlx", threads=1)
    assert found == expected, (
        "the bits of results have changed; where that is meant, see the top of this file"
    )
