# SPDX-License-Identifier: Apache-2.0
"""Rays of samples that parts of a bake cast for the session without paths: in any pieces, each once."""

from __future__ import annotations

from collections.abc import Iterator

import deltalux as dl
import numpy as np
import pytest
from deltalux.cluster.shard import MemoryArchive
from deltalux.errors import FormatError, OptionError
from deltalux.session import ranges
from lit_scenes import pools_and_sconce
from oracles import world
from rooms import box, translation

OPTIONS = {"paths": 2000, "gather": 32, "threads": 1}
SAMPLES = 400


def pools_and_panel() -> dl.Scene:
    """Narrow spots, and a dim panel in the ceiling that a board hides in part from much of the room."""
    scene = pools_and_sconce()
    corners = [(-0.5, 2.79, -0.5), (0.5, 2.79, -0.5), (0.5, 2.79, 0.5), (-0.5, 2.79, 0.5)]
    panel = dl.Mesh("panel", corners, [(0, 1, 2), (0, 2, 3)], "panel")
    board = dl.Mesh("board", *box((0.9, 0.02, 0.9), (0, 2.1, 0)), "wood")
    material = dl.Material("panel", (0.5,) * 3, (2,) * 3, group="panel")
    return dl.Scene([*scene.meshes, panel, board], [*scene.materials, material], scene.lights)


@pytest.fixture
def shared() -> Iterator[tuple[dl.Session, list[dl.Session], dl.Session]]:
    """A session with all paths; two parts that are baked; the session without paths, before its bake."""
    scene = pools_and_panel()
    samples = dl.Samples(*world.area_points(scene, SAMPLES, seed=5))
    with (
        dl.Session(scene, samples, **OPTIONS) as one,
        dl.Session(scene, samples, path_range=(0, 700), **OPTIONS) as first,
        dl.Session(scene, samples, path_range=(700, 2000), **OPTIONS) as second,
        dl.Session(scene, samples, path_range=(0, 0), **OPTIONS) as whole,
    ):
        for part in (one, first, second):
            part.bake()
        yield one, [first, second], whole


def light(core, part: dl.Session, first: int, last: int) -> None:
    core.take_direct(first, last, MemoryArchive(ranges.cast_direct(part, first, last)))


def look(core, part: dl.Session, first: int, last: int) -> None:
    aims = MemoryArchive(core.save_aims(first, last))
    core.take_hits(first, last, MemoryArchive(ranges.cast_gather_rays(part, first, last, aims)))


def equal(whole: dl.Session, parts: list[dl.Session], one: dl.Session) -> None:
    """Digest, light and errors are those of the session with all paths."""
    assert ranges.digest(whole, ranges.add_up([ranges.segments_hash(part) for part in parts])) == one.digest()
    np.testing.assert_array_equal(whole.irradiance, one.irradiance)
    np.testing.assert_array_equal(whole.standard_error, one.standard_error)


def test_pieces_in_any_order(shared):
    one, parts, whole = shared
    core = whole._core
    core.bake(None, leave_direct=True)
    for part in parts:
        ranges.add_to(core, ranges.path_changes(part))
        ranges.place_samples(part)
    for first, last in ((141, SAMPLES), (0, 1), (1, 140), (140, 141)):
        light(core, parts[first % 2], first, last)
    core.begin_gather(None)
    numbers = [
        ranges.number_rays(parts[first % 2], first, last) for first, last in ((0, 117), (117, SAMPLES))
    ]
    core.take_numbers(*map(np.concatenate, zip(*numbers, strict=True)))
    cuts = core.ray_cuts(4000).tolist()
    assert len(cuts) > 3 and cuts[-1] == SAMPLES
    for first, last in zip(cuts[-2::-1], cuts[:0:-1], strict=True):
        assert core.is_gathering()
        look(core, parts[first % 2], first, last)
    assert not core.is_gathering()
    equal(whole, parts, one)
    for x, y, z in ((-1.8, 0.3, -1), (1.1, 1.5, 0.5), (0.5, 1.8, 0.2)):  # within two beams; below the board
        for session in (one, whole, *parts):
            session.move("block", translation(x, y, z))
            session.update()
        for part in parts:
            ranges.add_path_changes(whole, ranges.path_changes(part))
        equal(whole, parts, one)


def test_what_is_out_of_order_is_refused(shared):
    _, parts, whole = shared
    core, part = whole._core, parts[0]
    none = MemoryArchive({})
    with pytest.raises(OptionError, match=r"call place_samples\(\)"):
        ranges.cast_direct(part, 0, 1)
    core.bake(None)
    with pytest.raises(OptionError, match="waits for no direct light"):
        core.take_direct(0, 1, none)
    with pytest.raises(OptionError, match="expected a baked one with a part of the paths"):
        core.place_samples()
    core.bake(None, leave_direct=True)
    for own in parts:
        ranges.add_to(core, ranges.path_changes(own))
        ranges.place_samples(own)
    with pytest.raises(OptionError, match="lacks direct light of some samples"):
        core.begin_gather(None)
    with pytest.raises(OptionError, match="found samples 3 to 401, expected some of 400"):
        ranges.cast_direct(part, 3, 401)
    light(core, part, 0, 30)
    with pytest.raises(OptionError, match="samples 29 to 31, of which some are there"):
        light(core, part, 29, 31)
    light(core, part, 30, SAMPLES)
    with pytest.raises(OptionError, match=r"expected begin_gather\(\)"):
        core.save_aims(0, 1)
    core.begin_gather(None)
    with pytest.raises(OptionError, match="waits for gather rays of others"):
        core.begin_gather(None)
    with pytest.raises(OptionError, match=r"take_numbers\(\), and take_hits\(\)"):
        core.ray_cuts(100)
    seen, doublings = ranges.number_rays(part, 0, SAMPLES)
    with pytest.raises(OptionError, match="numbers of rays for 399 of 400 samples"):
        core.take_numbers(seen, doublings[1:])
    with pytest.raises(OptionError, match="a number of rays that no sample has"):
        core.take_numbers(seen, doublings + np.int8(9))
    with pytest.raises(OptionError, match="a guide that is not there"):
        core.take_numbers(np.full_like(seen, 255), doublings)
    core.take_numbers(seen, doublings)
    with pytest.raises(FormatError):
        ranges.cast_gather_rays(part, 0, 31, MemoryArchive(core.save_aims(0, 30)))
    look(core, part, 0, 30)
    with pytest.raises(OptionError, match="samples 0 to 30, of which some are there"):
        look(core, part, 0, 30)
