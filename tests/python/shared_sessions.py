# SPDX-License-Identifier: Apache-2.0
"""Sessions that share the paths of one bake, each with a range, beside one that evaluates them."""

from __future__ import annotations

import pickle
from collections.abc import Sequence

import deltalux as dl
import numpy as np
from deltalux.session import ranges
from edit_sequences import apply

NONE = (0, 0)


class Shared:
    """A session for each range, and one without paths that evaluates their sums."""

    def __init__(
        self, scene: dl.Scene, samples: dl.Samples, cuts: Sequence[tuple[int, int]], **options
    ) -> None:
        self.parts = [dl.Session(scene, samples, path_range=own, **options) for own in cuts]
        self.whole = dl.Session(scene, samples, path_range=NONE, **options)

    def __enter__(self) -> Shared:
        return self

    def __exit__(self, *_) -> None:
        for session in (*self.parts, self.whole):
            session.close()

    def bake(self) -> list[dl.Frame]:
        frames = [part.bake() for part in self.parts]
        self.whole.bake()
        self.add()
        self.gather()
        return frames

    def add(self) -> None:
        changes = [pickle.loads(pickle.dumps(ranges.path_changes(part))) for part in self.parts]
        ranges.add_path_changes(self.whole, ranges.add_up(changes))

    def gather(self) -> None:
        ranges.gather(self.whole)

    def update(self, edits: Sequence) -> list[dl.Frame]:
        for session in (*self.parts, self.whole):
            for edit in edits:
                apply(session, edit)
        self.whole.update()
        frames = [part.update() for part in self.parts]
        self.add()
        return frames

    def digest(self) -> str:
        return ranges.digest(self.whole, ranges.add_up([ranges.segments_hash(part) for part in self.parts]))

    def equals(self, one: dl.Session) -> None:
        """All sums and all results are those of a session with all paths."""
        own, added = ranges.path_sums(one), ranges.add_up([ranges.path_sums(part) for part in self.parts])
        assert own.paths == added.paths == sum(part.statistics["held_paths"] for part in self.parts)
        np.testing.assert_array_equal(added.discs, own.discs)
        np.testing.assert_array_equal(added.cells, own.cells)
        np.testing.assert_array_equal(sum(part.sums for part in self.parts), one.sums)
        np.testing.assert_array_equal(self.whole.sums, one.sums)
        for kind in ("emitted", "absorbed", "escaped"):
            np.testing.assert_array_equal(
                np.sum([p.energy[kind] for p in self.parts], axis=0), one.energy[kind]
            )
        assert self.digest() == one.digest()
        np.testing.assert_array_equal(self.whole.irradiance, one.irradiance)
        np.testing.assert_array_equal(self.whole.standard_error, one.standard_error)
        assert self.whole.unreached == one.unreached

    def gradient(self) -> np.ndarray:
        return ranges.gradient(self.whole, ranges.add_up([ranges.gradient_sums(part) for part in self.parts]))
