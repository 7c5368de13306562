# SPDX-License-Identifier: Apache-2.0
"""Every method on the same segments and the same samples of a scene: cost, error, bias (paper 1.2, 2)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from deltalux.errors import OptionError, SceneError
from deltalux.estimate import disc_index
from deltalux.mesh.surfaces import NOTHING
from deltalux.results import Estimate
from deltalux.samples import Samples
from deltalux.scene import Scene
from deltalux.segments import Progress, Segments, trace
from deltalux.units import photopic

from .measuring import Measured, measured
from .method_errors import Reference
from .method_list import DISC, INDEX, LOSSY, METHODS, NEAREST, Answer, Inputs, Method, method
from .progress_parts import named, part_of
from .sample_classes import CLASSES, classify
from .sessions import VertexSessions

UNLIT = 0.01  # share of the mean reference; darker samples are covered or unlit and have no relative error
NOISE_BATCHES = 8
REFERENCE, SESSION = "reference", "session"
EQUAL_WHOLE, EQUAL_CLIPPED = "discs_of_k", "clipped_discs_of_k"
REFERENCE_SEED = 1_000_003  # added to the seed, so that the reference shares no path


class MethodStudy:
    """Comparison of all methods in one scene.

    Parameters
    ----------
    scene : Scene
    paths : light paths, whose segments all methods use
    samples : number of samples to estimate, drawn at random from the vertices of the display mesh
    spacing : metres between the vertices; None = automatic
    seed : seed of the paths and of the drawn samples
    k : number of neighbours for the k-nearest methods, at least 3
    reference : paths of the reference, as a multiple of `paths`
    threads : None = all
    """

    def __init__(
        self,
        scene: Scene,
        *,
        paths: int = 300_000,
        samples: int = 20_000,
        spacing: float | None = None,
        seed: int = 1,
        k: int = 50,
        reference: int = 16,
        threads: int | None = None,
    ) -> None:
        if k < 3:
            raise OptionError(f"k: found {k}, expected at least 3")
        self.scene, self.paths, self.seed, self.k, self.threads = scene, paths, seed, k, threads
        self._count, self._reference_paths = samples, reference * paths
        self.vertices = Samples.on_vertices(scene, spacing, share=False)
        assert self.vertices.display is not None  # on_vertices makes one
        self.display = self.vertices.display
        self._sessions = VertexSessions(scene, self.vertices, threads)
        self._points, self._normals = self.display.world(scene, samples=True)

    def trace(self, progress: Progress | None = None) -> None:
        """Trace the segments, and set `classes`, the class of each vertex."""
        segments = trace(self.scene, self.paths, self.seed, threads=self.threads, progress=progress)
        assert segments.primitive is not None  # of traced ones
        self._hits = int((segments.primitive != NOTHING).sum())
        self.classes = classify(self.scene, self.display, self.k, self._hits)
        self._inputs = Inputs(self.scene, segments, self.display, self.k, self.threads)

    def run(self, pictured: np.ndarray, progress: Progress | None = None) -> dict[str, Any]:
        """Run every method on the traced segments.

        Parameters
        ----------
        pictured : (p,) rows of the display mesh whose irradiance `pictures` will need
        progress : callable (stage, fraction) -> keep going

        Returns
        -------
        dict of JSON values: settings, `classes`, `methods`, `equal_count`, `plain_over_unbiased`

        Raises
        ------
        SceneError : no light reaches the samples
        """
        drawn = self._drawn()
        self._seen = np.unique(pictured)
        self._gather_references(np.union1d(drawn, self._seen), named(progress, "reference"))
        self.rows = self._lit(drawn)
        classes = self.classes.number[self.rows]
        irradiance, error = self._reference
        self._against = Reference(irradiance[self.rows], error[self.rows], classes)
        data = self._settings(len(drawn))
        data["methods"] = self._methods(named(progress, "methods"))
        data["equal_count"] = self._equal_count(data["methods"], named(progress, "equal counts"))
        data["classes"] = self._classes(data["equal_count"]["radius"], named(progress, "noise"))
        data["plain_over_unbiased"] = self._plain_over_unbiased()
        return data

    def pictures(self, names: Sequence[str], progress: Progress | None = None) -> dict[str, np.ndarray]:
        """(n, 3) irradiance of the display mesh by each of these; 0 except at the `pictured` rows of `run`.

        Parameters
        ----------
        names : names of methods, "session" or "reference"
        progress : callable (stage, fraction) -> keep going
        """
        progress = named(progress, "pictures")
        result = {}
        for index, name in enumerate(names):
            part = part_of(progress, index / len(names), (index + 1) / len(names))
            values = result[name] = np.zeros((len(self.display.points), 3))
            if name == SESSION:
                values[self._seen] = self._session[self._seen]
            elif name == REFERENCE:
                values[self._seen] = self._reference[0][self._seen]
            else:
                asked = self._samples(self._seen)
                values[self._seen] = method(name).run(self._inputs, asked, self._seen, part).irradiance
        return result

    def _drawn(self) -> np.ndarray:
        count = len(self.display.points)
        chosen = np.random.default_rng(self.seed).choice(count, min(self._count, count), replace=False)
        return np.sort(chosen)

    def _gather_references(self, rows: np.ndarray, progress: Progress | None) -> None:
        """Bake these rows with a session on the same paths, and with a reference session on many more."""
        count = len(self.display.points)
        self._radius = np.full(count, np.nan)
        self._session = np.zeros((count, 3))
        self._reference = np.zeros((count, 3)), np.zeros((count, 3))
        own: dict[str, Any] = {"paths": self.paths, "seed": self.seed, "direct": "paths"}
        with self._sessions.bake(rows, **own, progress=part_of(progress, 0, 0.1)) as session:
            self._radius[rows] = session.radius
            self._session[rows] = session.irradiance
        other: dict[str, Any] = {
            "paths": self._reference_paths,
            "seed": self.seed + REFERENCE_SEED,
            "direct": "sampled",
        }
        with self._sessions.bake(rows, **other, progress=part_of(progress, 0.1, 1)) as session:
            self._reference[0][rows] = session.irradiance
            self._reference[1][rows] = session.standard_error

    def _samples(self, rows: np.ndarray, radius: float | None = None) -> Samples:
        """Vertices in world space, with `radius` or the radii that the session chose."""
        return Samples(
            self._points[rows], self._normals[rows], self._radius[rows] if radius is None else radius
        )

    def _lit(self, drawn: np.ndarray) -> np.ndarray:
        light = photopic(self._reference[0][drawn])
        lit = light > UNLIT * light.mean() if len(light) else np.zeros(0, bool)
        if not lit.any():
            raise SceneError("compare-methods: found no light at any sample, expected a lit scene")
        return drawn[lit]

    def _settings(self, drawn: int) -> dict[str, Any]:
        return {
            "unit": self.scene.unit,
            "paths": self.paths,
            "segments": len(self._inputs.segments),
            "surface_hits": self._hits,
            "seed": self.seed,
            "k": self.k,
            "samples": len(self.rows),
            "left_out": drawn - len(self.rows),
            "disc_radius": float(np.median(self._radius[self.rows])),
            "gather_area": self.classes.gather_area,
            "gather_radius": self.classes.gather_radius,
            "reference_paths": self._reference_paths,
            "reference_error": self._against.noise(np.arange(len(self.rows))),
        }

    # ---- every method ---------------------------------------------------------------------------

    def _methods(self, progress: Progress | None) -> list[dict[str, Any]]:
        self._answers: dict[str, tuple[np.ndarray, Answer]] = {}
        result = []
        for index, each in enumerate(METHODS):
            part = part_of(progress, index / len(METHODS), (index + 1) / len(METHODS))
            result.append(self._measure(each, part))
        everywhere = np.arange(len(self.rows))
        errors = self._against.figures(self._session[self.rows], everywhere)
        row = {"name": SESSION, "label": "session, clipped discs", "kind": DISC}
        return [*result, {**row, "samples": len(everywhere), **errors}]

    def _measure(self, each: Method, progress: Progress | None) -> dict[str, Any]:
        which = np.arange(len(self.rows))
        if each.at_most < len(which):  # evenly spaced, since consecutive rows are often neighbours
            which = which[np.linspace(0, len(which) - 1, each.at_most).astype(np.int64)]
        rows = self.rows[which]
        samples = self._samples(rows)
        ran: Measured[Answer] = measured(lambda: each.run(self._inputs, samples, rows, progress))
        answer = ran.value
        self._answers[each.name] = which, answer
        tests = [
            value
            for key, value in answer.stats.items()
            if key.endswith("_tests") and not isinstance(value, list)  # not the counts per level
        ]
        row = {
            "name": each.name,
            "label": each.label,
            "kind": each.kind,
            "samples": len(which),
            "cpu_seconds": ran.cpu_seconds,
            "seconds": ran.seconds,
            "memory_bytes": ran.memory_bytes,
            "tests": int(sum(tests)) if tests else None,
            "hits": int(answer.stats["hits"]),
        }
        if each.kind in (DISC, LOSSY):
            row |= self._exactness(which, answer)
        return row | self._against.figures(answer.irradiance, which)

    def _exactness(self, which: np.ndarray, answer: Answer) -> dict[str, Any]:
        """Whether sums equal those of the disc index at the same samples, and the share of power lost."""
        whole = self._answers[INDEX][1]
        assert whole.sums is not None and answer.sums is not None  # of disc methods
        there = whole.sums[which]
        lost = 1 - float(answer.sums.sum()) / max(float(there.sum()), 1.0)
        return {"equal": bool((answer.sums == there).all()), "lost": lost}

    def _plain_over_unbiased(self) -> float:
        """Mean ratio of the plain to the unbiased photon map; k / (k - 1) where k hits are found."""
        plain, unbiased = (
            photopic(self._answers[n][1].irradiance) for n in ("photon_map_plain", "photon_map")
        )
        return float(plain.sum() / unbiased.sum()) if unbiased.sum() > 0 else 1.0

    # ---- fixed area against fixed count ---------------------------------------------------------

    def _equal_count(self, methods: Sequence[dict[str, Any]], progress: Progress | None) -> dict[str, Any]:
        """Errors of discs of one radius, which k segments cross on average, and of the k-nearest methods."""
        radius = self._radius_for_k(part_of(progress, 0, 0.4))
        counts, mean = self._counts(radius, progress=part_of(progress, 0.4, 0.5))
        samples = self._samples(self.rows, radius)
        everywhere = np.arange(len(self.rows))
        whole = self._disc_index(samples, self._inputs.segments, part_of(progress, 0.5, 0.6)).irradiance
        own: dict[str, Any] = {"paths": self.paths, "seed": self.seed, "direct": "paths", "radius": radius}
        with self._sessions.bake(self.rows, **own, progress=part_of(progress, 0.6, 1)) as session:
            clipped = session.irradiance
        rows = [
            {"name": name, "label": label, **self._against.figures(values, everywhere)}
            for name, label, values in (
                (EQUAL_WHOLE, "fixed area, whole discs", whole),
                (EQUAL_CLIPPED, "fixed area, discs clipped to what they reach", clipped),
            )
        ]
        costs = ("kind", "samples", "cpu_seconds", "seconds", "memory_bytes", "tests", "hits")
        rows += [
            {key: value for key, value in row.items() if key not in costs}
            | {"label": f"fixed count, {row['label']}"}
            for row in methods
            if row["kind"] == NEAREST
        ]
        return {"radius": radius, "mean_count": mean, "count_by_class": counts, "rows": rows}

    def _radius_for_k(self, progress: Progress | None) -> float:
        radius = self.classes.gather_radius
        for turn in range(2):  # counts grow with the square of the radius, except where edges cut discs
            mean = self._counts(radius, progress=part_of(progress, turn / 2, (turn + 1) / 2))[1]
            radius *= float(np.sqrt(self.k / mean)) if mean > 0 else 1.0
        return radius

    def _counts(self, radius: float, progress: Progress | None) -> tuple[dict[str, float | None], float]:
        """Mean number of segments that cross a disc: by class, and over all samples."""
        ones = self._inputs.segments.select(slice(None))
        ones.quanta = np.ones((len(ones), 3), np.uint32)
        found = self._disc_index(self._samples(self.rows, radius), ones, progress).sums
        assert found is not None  # of a disc method
        own = self.classes.number[self.rows]
        means = {
            name: float(found[own == i, 0].mean()) if (own == i).any() else None
            for i, name in enumerate(CLASSES)
        }
        return means, float(found[:, 0].mean())

    def _disc_index(self, samples: Samples, segments: Segments, progress: Progress | None) -> Estimate:
        return disc_index(segments, samples, threads=self.threads, progress=progress)

    def _classes(self, radius: float, progress: Progress | None) -> list[dict[str, Any]]:
        """Per class: size, reference error, and noise of the bias (standard error of the mean error)."""
        own = self.classes.number[self.rows]
        segments, samples = self._inputs.segments, self._samples(self.rows, radius)
        means = []
        for batch in range(NOISE_BATCHES):
            part = segments.select(segments.path % NOISE_BATCHES == batch)
            share = part_of(progress, batch / NOISE_BATCHES, (batch + 1) / NOISE_BATCHES)
            values = NOISE_BATCHES * self._disc_index(samples, part, share).irradiance
            relative = self._against.relative(values, np.arange(len(self.rows))).mean(axis=1)
            means.append(
                [relative[own == i].mean() if (own == i).any() else 0.0 for i in range(len(CLASSES))]
            )
        noise = np.std(means, axis=0, ddof=1) / np.sqrt(NOISE_BATCHES)
        return [
            {
                "name": name,
                "samples": int((own == i).sum()),
                "reference_error": self._against.noise(own == i) if (own == i).any() else None,
                "bias_noise": float(noise[i]),
            }
            for i, name in enumerate(CLASSES)
        ]
