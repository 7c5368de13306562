# SPDX-License-Identifier: Apache-2.0
"""A session on a cluster has the bits of one in this process, whatever shards, edits, files and losses."""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec
from pathlib import Path

import deltalux as dl
import numpy as np
import pytest
from builders.truth_kinds import truth_scene
from deltalux.cluster import extra, session
from deltalux.cluster.shard import Blueprint
from deltalux.cluster.shards import Shards, _Job
from deltalux.errors import Cancelled, Error, OptionError
from distributed import Client, LocalCluster
from edit_sequences import SEQUENCES, apply
from hypothesis import HealthCheck, given, settings
from lit_scenes import sunny_room
from rooms import box, room, samples_in, translation
from thoroughness import examples, slow

from .killing import Outcome, kills, quick_workers

PATHS = 1600
OPTIONS = [{"gather": 16}, {"direct": "paths", "gather": "off"}]


def equal(many: dl.ClusterSession, one: dl.Session) -> None:
    """Digest and all results are equal."""
    assert many.digest() == one.digest()
    for own, other in zip(many.read(), one.read(), strict=True):
        np.testing.assert_array_equal(own, other)
    np.testing.assert_array_equal(many.sums, one.sums)


@contextmanager
def baked(client: Client, shards: int) -> Iterator[tuple[dl.Session, dl.ClusterSession]]:
    """A session of this process and one of the cluster, both baked."""
    scene = room()
    samples, options = samples_in(scene), {"paths": PATHS, "gather": 8}
    with (
        dl.Session(scene, samples, **options) as one,
        dl.ClusterSession(scene, samples, client=client, shards=shards, **options) as many,
    ):
        one.bake()
        many.bake()
        yield one, many


def assert_equal_after_random_edits(many: dl.ClusterSession, one: dl.Session, equal=equal) -> None:
    """`equal` compares after each update."""

    @settings(max_examples=2, suppress_health_check=[HealthCheck.too_slow])
    @given(sequence=SEQUENCES)
    def edited(sequence):
        for edits in sequence:
            for edit in edits:
                apply(one, edit)
                apply(many, edit)
            frames = one.update(), many.update()
            assert frames[0].retraced_segments == frames[1].retraced_segments
            equal(many, one)

    edited()


@pytest.mark.parametrize("options", OPTIONS, ids=["rays", "discs"])
@pytest.mark.parametrize("shards", [slow(1), slow(2), 4, slow(16)])
def test_random_edits(client, shards, options):
    scene = room()
    samples, options = samples_in(scene), {"paths": PATHS} | options
    with (
        dl.Session(scene, samples, **options) as one,
        dl.ClusterSession(scene, samples, client=client, shards=shards, **options) as many,
    ):
        frames = one.bake(), many.bake()
        assert frames[0].affected_paths == frames[1].affected_paths
        assert frames[0].retraced_segments == frames[1].retraced_segments
        equal(many, one)

        assert_equal_after_random_edits(many, one)
        np.testing.assert_array_equal(many.gradient, one.gradient)
        for kind in ("emitted", "absorbed", "escaped"):
            assert list(many.energy[kind]) == list(one.energy[kind])
        for name in ("paths", "held_paths", "segments"):
            assert many.statistics[name] == one.statistics[name]
        assert many.unreached == one.unreached
        digest = many.digest()
        many.recompute()
        assert many.digest() == digest
        one.bake()
        many.bake()
        equal(many, one)
        assert many.notes == []


def equal_after_a_move_and_a_recompute(many: dl.ClusterSession, one: dl.Session) -> None:
    for each in (one, many):
        each.move("block", translation(-0.3, 0.5, 0.2))
        each.update()
    equal(many, one)
    many.recompute()
    equal(many, one)


@pytest.fixture
def added_up(monkeypatch):
    """Into how many parts the tree added what shards told, call by call; None: it failed."""
    found: list[int | None] = []
    tell = Shards.told

    def told(self, progress):
        parts = tell(self, progress)
        found.append(parts and len(parts))
        return parts

    monkeypatch.setattr(Shards, "told", told)
    return found


@pytest.mark.parametrize(("most", "parts"), [(2, 2), (3, 3), (8, 2), (9, None)])
def test_what_many_shards_tell_is_added_up_by_a_tree(client, monkeypatch, added_up, most, parts):
    """Nine parts become 5, 3 and then 2 by twos, 3 by threes, 2 by eights; by nines there is no tree."""
    monkeypatch.setattr(Shards, "most_parts", most)
    with baked(client, 9) as (one, many):
        equal(many, one)
        equal_after_a_move_and_a_recompute(many, one)
        assert added_up == ([parts] * 3 if parts else [])
        assert many.notes == []


def test_where_the_tree_fails_each_shard_is_asked(client, monkeypatch):
    monkeypatch.setattr(Shards, "told", lambda self, progress: None)
    with baked(client, 9) as (one, many):
        equal_after_a_move_and_a_recompute(many, one)


def test_a_cancelled_tree_leaves_the_update_for_the_next_call(client, monkeypatch):
    def cancelled(self, progress):
        raise Cancelled("here")

    with baked(client, 9) as (one, many):
        for each in (one, many):
            each.move("block", translation(-0.3, 0.5, 0.2))
        with monkeypatch.context() as patch:
            patch.setattr(Shards, "told", cancelled)
            with pytest.raises(Cancelled):
                many.update()
        assert many.unfinished
        one.update()
        many.update()
        equal(many, one)


def test_calls_of_actors_that_are_known_to_be_gone_do_nothing():
    """As Dask's proxies do where the scheduler has said so, by RuntimeError from the attribute itself."""

    class Gone:
        def __getattr__(self, name):
            raise RuntimeError("Worker holding Actor was lost.  Status: error")

    scene = room()
    blueprint = Blueprint(scene, samples_in(scene), {"paths": PATHS}, "")
    shards = Shards(None, blueprint, 2, 1.0)
    shards._proxies[0] = Gone()
    shards._cancel([0, 1])
    job = _Job(0, [("bake", ())], [], reply=object())
    shards._ask_how_far(job)
    assert job.told is None


def test_an_actor_whose_worker_ends_as_it_is_asked_for_is_lost_like_others():
    """Dask's future of it is still finished when it is looked at, and its result raises."""

    class Future:
        status = "finished"

        def result(self):
            self.status = "error"
            raise RuntimeError("Worker holding Actor was lost")

    scene = room()
    shards = Shards(None, Blueprint(scene, samples_in(scene), {"paths": PATHS}, ""), 1, 1.0)
    shards._actors[0] = Future()
    job, lost = _Job(0, [("bake", ())], []), []
    shards._lose = lambda job, why, make: lost.append(why)
    assert not shards._advance(job, None)
    assert shards._advance(job, None)
    assert lost == ["its actor's state is error"]


def test_edits_before_the_bake_and_between_updates(client):
    scene = room()
    with (
        dl.Session(scene, samples_in(scene), paths=PATHS, gather=16) as one,
        dl.ClusterSession(scene, samples_in(scene), client=client, paths=PATHS, gather=16) as many,
    ):
        assert many.shards == 4
        assert not many.baked
        with pytest.raises(OptionError, match="call bake"):
            many.irradiance  # noqa: B018
        for each in (one, many):
            each.move("block", translation(-0.3, 0.5, 0.2))
            each.set_reflectance("wall", (0.3, 0.3, 0.3))
            each.bake()
            each.add(dl.Mesh("new", *box((0.3, 0.3, 0.3)), "glow", pose=translation(0, 1, 0), movable=True))
            each.move("new", translation(0.1, 0.9, 0.1))
        equal(many, one)
        for each in (one, many):
            each.remove("new")
        assert many.unfinished
        assert (
            many.at([(0.2, 0.8, 0.1)], [(0, 1, 0)]).tolist()
            == one.at([(0.2, 0.8, 0.1)], [(0, 1, 0)]).tolist()
        )
        equal(many, one)
        one.rebake(scene)
        many.rebake(scene)
        assert isinstance(many, dl.ClusterSession)
        equal(many, one)


def test_suns(client):
    scene = sunny_room()
    samples, options = dl.Samples.on_vertices(scene, spacing=0.5), {"paths": 2000, "gather": 64}
    with (
        dl.Session(scene, samples, **options) as one,
        dl.ClusterSession(scene, samples, client=client, shards=3, **options) as many,
    ):
        one.bake()
        many.bake()
        assert many.statistics["gather"]["suns"] == 1
        equal(many, one)
        for each in (one, many):
            each.move("block", translation(0.8, 0.6, 0.2))
            each.update()
        equal(many, one)


@pytest.mark.parametrize("number", [39, slow(92)], ids=["a hole to a lit room", "a window below a sky"])
def test_what_is_chosen_by_all_samples(client, number):
    """Openings that gather rays go through, and what the paths of a sky are aimed at."""
    truth = truth_scene(2, number, 48)
    samples, options = dl.Samples(truth.points, truth.normals), {"paths": 20_000, "gather": 64}
    with (
        dl.Session(truth.scene, samples, **options) as one,
        dl.ClusterSession(truth.scene, samples, client=client, shards=3, **options) as many,
    ):
        one.bake()
        many.bake()
        equal(many, one)


@pytest.mark.parametrize("options", OPTIONS, ids=["rays", "discs"])
def test_files_of_either_open_in_the_other(client, tmp_path, options):
    scene = room()
    samples, options = samples_in(scene), {"paths": PATHS, "segment_end": "bounded"} | options
    with (
        dl.Session(scene, samples, **options) as one,
        dl.ClusterSession(scene, samples, client=client, shards=3, **options) as many,
    ):
        for each, name in ((one, "one.dlx"), (many, "many.dlx")):
            each.bake()
            each.move("lamp", translation(-0.4, 0.7, 0.3))
            each.add(dl.Mesh("new", *box((0.3, 0.3, 0.3)), "glow", pose=translation(0, 1, 0), movable=True))
            each.save(tmp_path / name)
        with (
            dl.Session.open(tmp_path / "many.dlx") as from_many,
            dl.ClusterSession.open(tmp_path / "one.dlx", client=client, shards=2) as from_one,
            dl.ClusterSession.open(tmp_path / "many.dlx", client=client, shards=5) as again,
        ):
            assert from_many.options == one.options == from_one.options
            for each in (from_many, from_one, again):
                np.testing.assert_array_equal(each.irradiance, one.irradiance)
            assert from_many.digest() == from_one.digest() == again.digest() == one.digest()
            for each in (one, from_many, from_one, again):
                each.move("block", translation(-0.2, 0.6, -0.1))
                each.update()
            assert from_many.digest() == from_one.digest() == again.digest() == one.digest()
            from_many.recompute()
            assert from_many.digest() == one.digest()


def test_files_without_light(client, tmp_path):
    scene = room()
    with dl.ClusterSession(scene, samples_in(scene), client=client, paths=PATHS, gather=8) as many:
        many.dim("desk", 0.25)
        many.save(tmp_path / "dark.dlx")
    with dl.Session.open(tmp_path / "dark.dlx") as opened:
        assert not opened.baked
        assert opened.dim_factors["desk"] == 0.25


def test_a_killed_worker():
    """As below, until the death of one has cost a shard."""
    outcomes: list[Outcome] = []
    with quick_workers() as client:
        for outcome in kills(client, 30, seed=5):
            outcomes.append(outcome)
            if len(outcomes) >= 3 and any(each.lost for each in outcomes):
                break
    assert all(outcome.right for outcome in outcomes), outcomes
    assert any(outcome.lost for outcome in outcomes)


@pytest.mark.slow
def test_killed_workers():
    """A shard whose worker dies in a bake or an update is traced again, to the same bits, in time."""
    with quick_workers() as client:
        outcomes = [*kills(client, examples(30), seed=5), *kills(client, examples(20), seed=6, shards=10)]
    assert all(outcome.right for outcome in outcomes), outcomes
    assert sum(outcome.lost > 0 for outcome in outcomes) >= 0.3 * len(outcomes)


def test_progress_and_cancelling(client, tmp_path):
    scene = room()
    told = []
    with (
        dl.Session(scene, samples_in(scene), paths=200_000, gather=8) as one,
        dl.ClusterSession(scene, samples_in(scene), client=client, paths=200_000, gather=8) as many,
    ):
        many.progress = lambda stage, fraction: stage != "trace shards"
        with pytest.raises(Cancelled):
            many.bake()
        assert not many.baked
        many.progress = lambda stage, fraction: told.append((stage, fraction))
        many.bake()
        one.bake()
        shares = [fraction for stage, fraction in told if stage == "trace shards"]
        assert shares == sorted(shares) and 0 < shares[-1] <= 1
        many.progress = lambda stage, fraction: stage != "trace shards"
        for each in (one, many):
            each.set_reflectance("wall", (0.8, 0.8, 0.8))
        with pytest.raises(Cancelled):
            many.update()
        with pytest.raises(OptionError, match="found the sums of 0 paths after 1 edits, expected those of"):
            many.irradiance  # noqa: B018
        assert many.unfinished
        many.progress = None
        one.update()
        equal(many, one)
        many.progress = lambda stage, fraction: stage != "trace shards"
        with pytest.raises(Cancelled):
            many.bake()
        with pytest.raises(OptionError, match="save: found a bake that was cancelled"):
            many.save(tmp_path / "half.dlx")
        assert list(tmp_path.iterdir()) == []


def test_shards_have_stopped_when_a_call_is_cancelled(client, monkeypatch):
    """Else the end of a session would take actors away while calls are on their way to them."""
    call, replies = Shards._call, []

    def kept(self, *args):
        replies.append(call(self, *args))
        return replies[-1]

    monkeypatch.setattr(Shards, "_call", kept)
    scene = room()
    with dl.ClusterSession(
        scene, samples_in(scene), client=client, shards=2, paths=3_000_000, gather="off"
    ) as many:
        many.progress = lambda stage, fraction: stage != "trace shards" or fraction == 0
        with pytest.raises(Cancelled):
            many.bake()
        assert len(replies) > 4 and all(reply.done() for reply in replies)


def test_what_is_added_in_part_is_computed_again(client, monkeypatch):
    with baked(client, 3) as (one, many):
        for each in (one, many):
            each.move("block", translation(-0.3, 0.5, 0.2))
        added = []

        def interrupted(changes):
            if added:
                raise KeyboardInterrupt
            added.append(changes)
            type(many._core)._add(many._core, changes)

        with monkeypatch.context() as patch:
            patch.setattr(many._core, "_add", interrupted)
            with pytest.raises(KeyboardInterrupt):
                many.update()
        with pytest.raises(OptionError, match="expected those of all"):
            many.irradiance  # noqa: B018
        one.update()
        equal(many, one)


class Refusing:
    """A core's session that applies no edits, as where memory is too short for them."""

    def __init__(self, core) -> None:
        self._core = core
        self.edits_applied = False

    def __getattr__(self, name):
        return getattr(self._core, name)

    def update(self, *_):
        raise OptionError("refused")


def test_an_edit_that_is_refused_here_leaves_no_shard_ahead(client, monkeypatch):
    with baked(client, 2) as (one, many):
        before = many.irradiance
        many.move("block", translation(-0.3, 0.5, 0.2))
        with monkeypatch.context() as patch:
            patch.setattr(many._core, "_core", Refusing(many._core._core))
            with pytest.raises(OptionError, match="refused"):
                many.update()
        np.testing.assert_array_equal(many.irradiance, before)
        for each in (one, many):
            each.move("block", translation(0.3, 0.5, 0.2))
        equal(many, one)


def test_closing_frees_the_workers(client):
    def shards_held(dask_worker):
        return len(dask_worker.state.actors)

    scene = room()
    with dl.ClusterSession(scene, samples_in(scene), client=client, shards=4, paths=PATHS, gather=8) as many:
        many.bake()
        assert sum(client.run(shards_held).values()) == 4
        irradiance = many.irradiance
    end = time.monotonic() + 20
    while sum(client.run(shards_held).values()) and time.monotonic() < end:
        time.sleep(0.05)
    assert sum(client.run(shards_held).values()) == 0
    assert np.isfinite(irradiance).all()
    with pytest.raises(OptionError, match="it was closed"):
        many.bake()


@pytest.mark.parametrize(
    ("given", "said"),
    [({"path_range": (0, 5)}, r"^path_range: found \(0, 5\), expected None: the shards share all paths"),
     ({"shards": 0}, "^shards: found 0"), ({"shards": 2.5}, "^shards: found 2.5")],
)  # fmt: skip
def test_refused_options(client, given, said):
    scene = room()
    with pytest.raises(OptionError, match=said):
        dl.ClusterSession(scene, samples_in(scene), client=client, paths=PATHS, **given)


def test_more_shards_than_paths(client):
    scene = room()
    with (
        dl.ClusterSession(scene, samples_in(scene), client=client, shards=40, paths=24, gather="off") as many,
        dl.Session(scene, samples_in(scene), paths=24, gather="off") as one,
    ):
        many.bake()
        one.bake()
        assert many.digest() == one.digest()


def test_the_extra_is_named_where_it_is_missing(monkeypatch):
    monkeypatch.setattr(extra, "find_spec", lambda name: None if name == "distributed" else find_spec(name))
    with pytest.raises(Error, match=r'ClusterSession: found no module distributed.*"deltalux\[cluster\]"'):
        session.ClusterSession(room(), client=None)


def test_without_workers_it_gives_up_in_time():
    scene = room()
    with (
        LocalCluster(n_workers=0, dashboard_address="127.0.0.1:0") as cluster,
        Client(cluster) as client,
        dl.ClusterSession(
            scene, samples_in(scene), client=client, patience=0.5, paths=PATHS, gather=8
        ) as many,
    ):
        with pytest.raises(Error, match=r"found no worker for 0\.5 s, expected at least one at tcp://"):
            many.bake()
        late = threading.Timer(1.0, cluster.scale, (1,))
        late.start()
        many._patience = many._core._shards._patience = 60
        many.bake()
        late.join()
        assert Path(cluster.scheduler_address)
        assert np.isfinite(many.irradiance).all()
