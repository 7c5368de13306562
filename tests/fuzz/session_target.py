# SPDX-License-Identifier: Apache-2.0
"""Fuzz target: session files. What opens is read, edited, updated and saved again."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import deltalux as dl
import numpy as np
from deltalux.outputs import write
from deltalux.outputs.of_session import baked_of
from rooms import box, room, translation, with_texture
from session_files import read_parts

from fuzz.harness import MIB, Limits
from fuzz.mutate_json import Rng
from fuzz.mutate_session import write_mutated

MAX_SEED_BYTES = 4 << 20
MANY_PATHS = 20_000  # of a session without light: more would take long, and rightly so


def seed_sessions() -> Iterator[dl.Session]:
    """Small sessions of every kind: baked or not, by paths or by shadow rays, edited."""
    scene = with_texture(room())
    samples = dl.Samples.on_vertices(scene, spacing=1.0, radius=0.2)
    grid = dl.Samples.on_grid((-1.5, 0.8, -1), (3, 0, 0), (0, 0, 2), 0.7)
    options = {"paths": 300, "threads": 1}
    yield dl.Session(scene, samples, direct="sampled", **options)
    for methods in (
        {"direct": "paths", "static_method": "disc_index", "moving_method": "sphere_cache"},
        {"direct": "sampled", "static_method": "ray_map", "moving_method": "brute_force"},
    ):
        session = dl.Session(scene, samples, **methods, **options)
        session.bake()
        yield session
    gathered = dl.Session(scene, grid, gather=8, **options)
    gathered.bake()
    yield gathered
    edited = dl.Session(scene, grid, **options)
    edited.bake()
    edited.add(dl.Mesh("ball", *box((0.1, 0.1, 0.1)), "paint", pose=translation(0, 1.5, 0), movable=True))
    edited.move("block", translation(0.5, 0.4, 0.4))
    edited.remove("lamp")
    edited.set_reflectance("wall", (0.2, 0.3, 0.4))
    edited.update()
    yield edited


class SessionTarget:
    """Opens mutated files, edits and updates what opens."""

    name = "session"
    limits = Limits(growth=384 * MIB)

    def prepare(self, seeds: Path, scenes: Path | None) -> None:
        """Sessions of our own, small ones of a folder."""
        for number, session in enumerate(seed_sessions()):
            with session:
                session.save(seeds / f"own{number}.dlx")
        for number, path in enumerate(sorted(scenes.rglob("*.dlx")) if scenes else ()):
            if path.stat().st_size <= MAX_SEED_BYTES:
                shutil.copy(path, seeds / f"more{number}.dlx")

    def load(self, seeds: Path) -> None:
        """Keep them in memory."""
        self._seeds = [read_parts(path) for path in sorted(seeds.glob("*.dlx"))]

    def make(self, rng: Rng, folder: Path) -> None:
        """One file."""
        write_mutated(rng, folder / "session.dlx", self._seeds)

    def run(self, folder: Path) -> None:
        """Open it and go on from there."""
        with dl.Session.open(folder / "session.dlx", threads=1) as session:
            use(session, folder / "again.dlx")


def use(session: dl.Session, path: Path) -> None:
    """Do everything with a session that a user may; raise AssertionError for NaN or infinity."""
    if not session.baked:
        if session.options["paths"] > MANY_PATHS:
            return
        session.bake()
    elif session.foreign_build is not None:
        session.recompute()
    check_light(session)
    for material in list(session.reflectances)[:1]:
        session.set_reflectance(material, (0.1, 0.2, 0.3))
    for group in list(session.dim_factors)[:1]:
        session.dim(group, 0.5)
    for name, pose in list(session.poses.items())[:1]:
        if pose is not None:
            session.move(name, pose)
    session.update()
    check_light(session)
    if session.samples.display is not None:
        write(path.with_suffix(".glb"), baked_of(session, "fuzz"))
    digest = session.digest()
    session.save(path)
    with dl.Session.open(path, threads=1) as again:
        assert again.digest() == digest, "the file that a session from a file wrote is another session"


def check_light(session: dl.Session) -> None:
    """Raise AssertionError where results are not finite."""
    for values in (session.irradiance, session.standard_error, session.gradient, session.read_packed()):
        assert np.isfinite(values).all(), "NaN or infinity in the results"
    assert np.isfinite(session.radius).all()
