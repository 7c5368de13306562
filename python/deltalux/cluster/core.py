# SPDX-License-Identifier: Apache-2.0
"""The core's session of which shards hold the paths: all that `Session` asks of its core."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from deltalux.errors import OptionError
from deltalux.scene import Scene
from deltalux.segments import Progress
from deltalux.session import ranges

from .archive import WholeArchive, WithoutPaths
from .shard import Answer, Batch, Edit, Held, MemoryArchive, Seed
from .shards import Shards, Step, choices_of

# Of what a shard does at once: a fraction of a second of one thread, some MB of answer.
SAMPLES_OF_PIECE = 2048
RAYS_OF_PIECE = 1 << 18

_COUNTS = ("affected_paths", "removed_segments", "retraced_segments", "scanned_segments", "candidates")
_OF_SHARDS = ("held_paths", "segments", "segment_bytes")  # statistics that are those of all shards


class SharedCore:
    """Stands where a session has the core's session, and shares its work.

    The core's session within has no paths (`path_range=(0, 0)`): it adds up the sums of all shards, puts the
    shadow rays and gather rays that shards cast in a bake in place, casts those that edits change, and is
    what light is read from. Edits have numbers, by batches. A state is complete when all shards told what the
    last batch changed; only then it can be read, which the core's session itself watches over. A shard that
    is lost is made again in the last complete state, of the bake's choices, and takes the batches since.

    Parameters
    ----------
    core : the core's session without paths
    shards : Shards
    scene : that the session is made of
    """

    def __init__(self, core: Any, shards: Shards, scene: Scene) -> None:
        self._core, self._shards, self._scene = core, shards, scene
        self.said: list[Edit] = []  # edits that are queued
        self.edits_applied = True
        self._number = 0  # of the last batch in effect
        self._batches: tuple[Batch, ...] = ()  # in effect since the seed; before the first bake: all
        self._seed: Seed | None = None  # the last complete state, where the present one is not
        self._since: int | None = None  # edits in effect in the last complete state
        self._lit = False  # whether bake and gather rays are complete
        self._in_doubt = False  # whether sums may have been added in part

    def __getattr__(self, name: str) -> Any:
        return getattr(self._core, name)

    def close(self) -> None:
        """Free the shards' memory."""
        self._shards.close()

    @property
    def baked(self) -> bool:
        """Whether there is light."""
        return self._lit

    @property
    def _was_lit(self) -> bool:
        """Whether there was light once: before, `_batches` are all edits."""
        return self._since is not None

    @property
    def pending(self) -> float:
        """Share of the work that waits."""
        return 1.0 if self._seed is not None or self._in_doubt else self._core.pending

    @property
    def notes(self) -> list[str]:
        """What happened to workers."""
        return self._shards.notes

    # ---- work ---------------------------------------------------------------------------------------

    def bake(self, progress: Progress | None) -> dict[str, Any]:
        """Compute everything. If this is cancelled, there is no light until the next bake."""
        self._lit = False
        try:
            frame = self._bake(progress)
        except BaseException:
            self._core.forget_bake()
            raise
        self._lit = True
        return frame

    def _bake(self, progress: Progress | None) -> dict[str, Any]:
        frame: dict[str, Any] = {}
        begin = time.perf_counter()
        changes, answers = self._answers(
            "bake", self._batches, seed=self._present, again=False, fresh=not self._was_lit,
            meanwhile=lambda: frame.update(self._core.bake(progress, leave_direct=True)),
            progress=progress,
        )  # fmt: skip
        stages = frame["milliseconds"]
        stages["shards"] = max(0.0, 1e3 * (time.perf_counter() - begin) - sum(stages.values()))
        for own in changes:
            self._add(own)
        for stage, work in (("direct", self._light), ("gather", self._gather)):
            begin = time.perf_counter()
            work(progress)
            stages[stage] = stages.get(stage, 0.0) + 1e3 * (time.perf_counter() - begin)
        self._complete()
        return _with_counts(frame, answers)

    def _light(self, progress: Progress | None) -> None:
        """Let shards cast shadow rays from samples to lights."""
        if not self._core.awaits_direct():
            return
        cuts = self._cuts()
        self._share(
            "direct light", ("place_samples", ()), cuts,
            lambda first, last: ("cast_direct", (first, last)),
            lambda first, last, found: self._core.take_direct(first, last, MemoryArchive(found)), progress,
        )  # fmt: skip

    def _gather(self, progress: Progress | None) -> None:
        """Let shards choose numbers of gather rays and cast them."""
        core = self._core
        core.begin_gather(progress)
        if not core.is_gathering():
            return
        place: Step = ("place_samples", ())
        cuts = self._cuts()
        numbers: dict[int, Any] = {}
        self._share(
            "find noisy places", place, cuts,
            lambda first, last: ("number_rays", (first, last)),
            lambda first, last, found: numbers.update({first: found}), progress,
        )  # fmt: skip
        in_order = (numbers[first] for first in cuts[:-1])
        core.take_numbers(*map(np.concatenate, zip(*in_order, strict=True)))
        self._share(
            "cast gather rays", place, core.ray_cuts(RAYS_OF_PIECE).tolist(),
            lambda first, last: ("cast_gather_rays", (first, last, core.save_aims(first, last))),
            lambda first, last, found: core.take_hits(first, last, MemoryArchive(found)), progress,
        )  # fmt: skip

    def _cuts(self) -> list[int]:
        samples = self._core.statistics()["samples"]
        return [*range(0, samples, SAMPLES_OF_PIECE), samples]

    def _share(
        self,
        stage: str,
        join: Step,
        cuts: Sequence[int],
        step: Callable[[int, int], Step],
        take: Callable[[int, int, Any], None],
        progress: Progress | None,
    ) -> None:
        """Let shards do `step` for each range of samples between cuts, and take what they found."""
        self._shards.share(
            stage, join, len(cuts) - 1,
            lambda piece: step(cuts[piece], cuts[piece + 1]),
            lambda piece, found: take(cuts[piece], cuts[piece + 1], found),
            seed=self._present, progress=progress,
        )  # fmt: skip

    def update(self, edits: Any, budget_ms: float, progress: Progress | None) -> dict[str, Any]:
        """Apply edits. A budget is for direct light and gather rays; shards always end their part."""
        self.edits_applied = False
        begin = time.perf_counter()
        if not self._core.baked:
            frame = self._core.update(edits, budget_ms, progress)
            self._take((*self._batches, self._queued()))
            return frame
        if self._in_doubt:
            self.recompute(progress)
        batches = (*self._batches, self._queued()) if self.said else self._batches
        if self.said and self._seed is None:
            self._seed = self._present()
        frame = {}

        def own_part() -> None:
            try:
                frame.update(self._core.update(edits, budget_ms, progress))
            finally:
                if self._core.edits_applied:
                    self._take(batches)

        if self._seed is None:  # nothing but gather rays may be pending
            own_part()
            return frame
        try:
            changes, answers = self._answers(
                "update", batches, self._since, seed=self._last_complete, meanwhile=own_part,
                progress=progress,
            )  # fmt: skip
        except BaseException:
            if not self.edits_applied and not self._batches:
                # the present state is complete, and shards may be ahead of it
                self._shards.forget_all()
                self._seed = None
            raise
        self._add_all(changes)
        frame["milliseconds"]["total"] = 1e3 * (time.perf_counter() - begin)
        return _with_counts(frame, answers)

    def recompute(self, progress: Progress | None) -> dict[str, Any]:
        """Compute everything again in the present state."""
        if self._in_doubt:
            self._shards.forget_all()
            self._batches, self._seed = (), None
        self._in_doubt = True
        changes, answers = self._answers("recompute", seed=self._present, again=False, progress=progress)
        frame = self._core.recompute(progress)
        self._add_all(changes)
        return _with_counts(frame, answers)

    def restore(self, arrays: Any, progress: Progress | None) -> None:
        """Take over what a file holds, but for paths: shards trace them again, to the same bits."""
        self._core.restore(WithoutPaths(arrays), progress)
        if self._core.baked:
            changes, _ = self._answers("recompute", seed=self._present, again=False, progress=progress)
            self._add_all(changes)
            self._lit = True

    def _queued(self) -> Batch:
        return Batch(self._number + 1, tuple(self.said))

    def _take(self, batches: tuple[Batch, ...]) -> None:
        """Note that these batches are in effect."""
        self.edits_applied = True
        if not self.said:
            return
        for edit in self.said:
            if edit.kind == "insert":
                self._scene = self._scene.with_mesh(edit.values[0])
        self._batches, self._number = batches, batches[-1].number
        self.said = []

    def _present(self) -> Seed:
        return Seed(self._scene, choices_of(self._core), self._number)

    def _last_complete(self) -> Seed:
        assert self._seed is not None
        return self._seed

    def _add(self, changes: ranges.PathChanges) -> None:
        ranges.add_to(self._core, changes)

    def _answers(
        self, command: str, *args: Any, progress: Progress | None, **how: Any
    ) -> tuple[list[ranges.PathChanges], list[Answer | Held]]:
        """Let all shards run a command; what changed of their sums, added up for many, and their answers.

        `how`: of `Shards.ask`.
        """
        if len(self._shards) <= self._shards.most_parts:
            answers = self._shards.ask(command, *args, progress=progress, **how)
            return [answer.changes for answer in answers], answers
        answers = self._shards.ask("hold", command, *args, progress=progress, **how)
        told = self._shards.told(progress)
        if told is None:  # some shard is lost
            again = {"seed": how["seed"], "progress": progress, "again": how.get("again", True)}
            step = (command, *args) if again["again"] else ("last_answer",)
            told = [answer.changes for answer in self._shards.ask(*step, **again)]
        return told, answers

    def _add_all(self, changes: Sequence[ranges.PathChanges]) -> None:
        """Add what all shards told; if that is interrupted, everything is computed again by the next call."""
        self._in_doubt = True
        for own in changes:
            self._add(own)
        self._complete()

    def _complete(self) -> None:
        self._batches, self._seed = (), None
        self._since = self._core.statistics()["edits"]
        self._in_doubt = False

    # ---- results ------------------------------------------------------------------------------------

    def digest(self) -> str:
        """Digest of the present state."""
        return self._core.digest_with(ranges.add_up(self._shards.ask("segments_hash", seed=self._present)))

    def gradient(self, progress: Progress | None) -> np.ndarray:
        """(n, 3, 3) surface gradients."""
        sums = ranges.add_up(self._shards.ask("gradient_sums", seed=self._present, progress=progress))
        return self._core.gradient_with(sums.discs, sums.moments, progress)

    def audit(self) -> dict[str, Any]:
        """The balance of energy of all shards' paths."""
        own = self._core.audit()
        audits = [audit for _, audit in self._figures()]
        kinds = ("emitted", "absorbed", "escaped")
        return {
            **own,
            **{k: [sum(column) for column in zip(*(a[k] for a in audits), strict=True)] for k in kinds},
        }

    def statistics(self) -> dict[str, Any]:
        """Counts of all shards together; memory of this process, and of the shards."""
        own = self._core.statistics()
        if not self._lit:
            return own
        found = [statistics for statistics, _ in self._figures()]
        own |= {name: sum(statistics[name] for statistics in found) for name in _OF_SHARDS}
        own["bytes_of_shards"] = sum(statistics["bytes"] for statistics in found)
        return own

    def _figures(self) -> list[tuple[Mapping[str, Any], Mapping[str, Any]]]:
        return self._shards.ask("figures", seed=self._present)

    def save(self) -> Any:
        """The arrays of a session with all paths."""
        if not self._lit:
            if self._was_lit:
                raise OptionError("save: found a bake that was cancelled, expected light; call bake() first")
            return self._core.save_choices()
        if self.pending:
            raise OptionError("save: found work that waits, expected none; call update() first")
        return WholeArchive(self._core.save(shared=True), self._shards.ask("paths", seed=self._present))


def _with_counts(frame: dict[str, Any], answers: Sequence[Answer | Held]) -> dict[str, Any]:
    """The frame with the counts of all shards."""
    for name in _COUNTS:
        frame[name] += sum(getattr(answer.frame, name) for answer in answers)
    return frame
