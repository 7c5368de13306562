# SPDX-License-Identifier: Apache-2.0
"""Rays of a bake that workers cast for ranges of samples: the bits of one process, whoever casts them."""

from __future__ import annotations

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import deltalux as dl
import numpy as np
import pytest
from deltalux.cluster import core
from deltalux.errors import Cancelled, OptionError
from lit_scenes import pools_and_sconce
from oracles import world
from rooms import room, samples_in, translation
from thoroughness import slow

from .killing import pid_of_holder, wait_for_all
from .test_cluster_session import assert_equal_after_random_edits

STAGES = ["direct light", "find noisy places", "cast gather rays"]


@pytest.fixture(autouse=True)
def small_pieces(monkeypatch):
    """So many that every shard gets some."""
    monkeypatch.setattr(core, "SAMPLES_OF_PIECE", 16)
    monkeypatch.setattr(core, "RAYS_OF_PIECE", 500)


def equal(many: dl.ClusterSession, one: dl.Session) -> None:
    """Digest, light and errors are equal, and so is what was chosen for gather rays."""
    assert many.digest() == one.digest()
    np.testing.assert_array_equal(many.irradiance, one.irradiance)
    np.testing.assert_array_equal(many.standard_error, one.standard_error)
    for name in ("rays", "chains", "guides", "beams"):
        assert many.statistics["gather"][name] == one.statistics["gather"][name]


@contextmanager
def sessions(client, shards: int, **options) -> Iterator[tuple[dl.Session, dl.ClusterSession]]:
    """A session of this process and one of the cluster, not baked, in a room with beams and guides."""
    scene = pools_and_sconce()
    samples, options = dl.Samples(*world.area_points(scene, 250, seed=5)), {"paths": 4000} | options
    with (
        dl.Session(scene, samples, **options) as one,
        dl.ClusterSession(scene, samples, client=client, shards=shards, **options) as many,
    ):
        yield one, many


def in_stage(stage: str, act: Callable[[], bool | None]) -> Callable[[str, float], bool | None]:
    """A progress callback that acts once, when the first pieces of a stage are done."""
    acted = []

    def progress(name: str, fraction: float) -> bool | None:
        if name != stage or not 0 < fraction < 1 or acted:
            return None
        acted.append(True)
        return act()

    progress.acted = acted  # type: ignore[attr-defined]
    return progress


@pytest.mark.parametrize("shards", [slow(1), slow(2), 5])
def test_rays_along_guides(client, shards, tmp_path):
    with sessions(client, shards, gather=32) as (one, many):
        told: list[tuple[str, float]] = []
        many.progress = lambda stage, fraction: told.append((stage, fraction))
        one.bake()
        many.bake()
        gather = one.statistics["gather"]
        assert gather["beams"] == 3 and gather["guides"] >= 1 and gather["rays"] > 32 * 250
        for stage in STAGES:
            shares = [fraction for name, fraction in told if name == stage]
            assert shares == sorted(shares) and len(set(shares)) > 2
        equal(many, one)
        for x, y, z in (
            (-1.8, 0.3, -1),
            (1.1, 1.5, 0.5),
            (-2.4, 1.4, 1.5),
        ):  # within two beams; before the strip
            for each in (one, many):
                each.move("block", translation(x, y, z))
                each.update()
            equal(many, one)
        for each in (one, many):
            each.move("lamp", translation(0.3, 2.4, -1.8))
            each.dim("a", 0.5)
            each.update()
        equal(many, one)
        many.save(tmp_path / "many.dlx")
        with dl.Session.open(tmp_path / "many.dlx") as opened:
            assert opened.digest() == one.digest()


@pytest.mark.slow
def test_defaults_and_random_edits(client):
    scene = room()
    samples = samples_in(scene)
    with (
        dl.Session(scene, samples, paths=1600) as one,
        dl.ClusterSession(scene, samples, client=client, paths=1600) as many,
    ):
        one.bake()
        many.bake()
        equal(many, one)
        assert_equal_after_random_edits(many, one, equal)
        one.bake()
        many.bake()
        equal(many, one)


@pytest.mark.parametrize("factor", [0.0, slow(0.1), slow(0.9)])
def test_lamps_that_are_dim_at_the_bake(client, factor):
    scene = room()
    samples = samples_in(scene)
    with (
        dl.Session(scene, samples, paths=1600, gather=64) as one,
        dl.ClusterSession(scene, samples, client=client, paths=1600, gather=64) as many,
    ):
        for each in (one, many):
            each.dim("desk", factor)
            each.bake()
        equal(many, one)


@pytest.mark.slow
@pytest.mark.parametrize("stage", STAGES)
def test_a_worker_that_is_killed_while_it_casts_rays(client, stage):
    with sessions(client, 4, gather=64) as (one, many):
        one.bake()
        for again in (False, True):
            wait_for_all(client)

            def kill() -> None:
                victims = [pid for pid in client.run(pid_of_holder).values() if pid]
                os.kill(victims[0], signal.SIGKILL)

            many.progress = in_stage(stage, kill)
            before = len(many.notes)
            many.bake()
            assert many.progress.acted and len(many.notes) > before, again
            many.progress = None
            equal(many, one)
        for each in (one, many):
            each.move("block", translation(-1.3, 0.3, -0.6))
            each.update()
        equal(many, one)


@pytest.mark.slow
@pytest.mark.parametrize("stage", STAGES)
def test_a_bake_that_is_cancelled_while_workers_cast_rays(client, stage):
    with sessions(client, 4, gather=64) as (one, many):
        one.bake()
        for _ in range(2):
            many.progress = in_stage(stage, lambda: False)
            with pytest.raises(Cancelled):
                many.bake()
            many.progress = None
            with pytest.raises(OptionError):
                many.irradiance  # noqa: B018
        many.bake()
        equal(many, one)
        many.progress = in_stage(stage, interrupt)
        with pytest.raises(KeyboardInterrupt):
            many.bake()
        many.progress = None
        for each in (one, many):
            each.move("block", translation(-1.3, 0.3, -0.6))
            each.bake()
        equal(many, one)


def interrupt() -> None:
    raise KeyboardInterrupt
