# SPDX-License-Identifier: Apache-2.0
"""`cost-scaling`: tests of the sphere cache and of disc indexing over the number of samples (Theorem 1)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from deltalux import estimate, model
from deltalux.segments import Progress, uniform_lines
from deltalux.studies.curves import power_law
from deltalux.studies.experiment import Cell, Curve, Experiment, Figure, Findings, Table, Verdict
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeats import averaged, certain_sign, mean_and_error, outcome_of, together
from deltalux.studies.uniform_samples import SPREADS, UNIT_SPHERE, WHERE, Spread, in_cube

CACHE, INDEX = "sphere cache", "disc index"
EXPONENT, NEAR = 1 / 3, 0.05
ALIKE = 1.25  # counts over theory up to which a constant is called right

Tests = Mapping[tuple[str, Spread], np.ndarray]  # method, spread -> (seeds, sample counts) tests per line


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Count the tests of both methods at each number of samples with each seed."""
    seeds, counts, threads = settings["seeds"], settings["sample_counts"], settings["threads"]
    steps = Steps(progress, len(seeds) * len(SPREADS) * len(counts))
    tests = {
        (method, spread): np.zeros((len(seeds), len(counts)))
        for method in (CACHE, INDEX)
        for spread in SPREADS
    }
    for row, seed in enumerate(seeds):
        lines = uniform_lines(settings["lines"], seed)
        for spread in SPREADS:
            for column, count in enumerate(counts):
                samples = in_cube(count, spread, seed)
                cache = estimate.sphere_cache(
                    lines,
                    samples,
                    settings["ratio"],
                    settings["min_rays"],
                    outer_sphere=UNIT_SPHERE,
                    threads=threads,
                ).stats
                index = estimate.disc_index(lines, samples, threads=threads).stats
                counted = cache["sphere_tests"] + cache["disc_tests"]
                tests[CACHE, spread][row, column] = counted / len(lines)
                tests[INDEX, spread][row, column] = index["disc_tests"] / len(lines)
                steps.done()
    return conclude(tests, settings)


def conclude(tests: Tests, settings: Mapping[str, Any]) -> Findings:
    """Make table, figures and verdicts from the counts.

    Parameters
    ----------
    tests : (method, spread) -> (seeds, sample counts) tests per line
    settings : settings of `run`
    """
    counts = np.array(settings["sample_counts"])
    ratio = settings["ratio"]
    return Findings(
        tables=[_table(tests, settings)],
        figures=[_figure(method, tests, settings) for method in (CACHE, INDEX)],
        verdicts=[
            cube_root(CACHE, tests[CACHE, "volume"], counts),
            constant(CACHE, tests[CACHE, "volume"], predicted(CACHE, "volume", counts, ratio)),
            cube_root(INDEX, tests[INDEX, "volume"], counts),
            constant(INDEX, tests[INDEX, "volume"], predicted(INDEX, "volume", counts, ratio)),
            logarithmic(tests[CACHE, "surface"], counts),
            constant(CACHE, tests[CACHE, "surface"], predicted(CACHE, "surface", counts, ratio), "surface"),
        ],
        notes=(
            "The exact sphere cache in Hilbert order, to full depth; sphere and disc tests count alike, "
            "t = u. Of the disc index disc tests are counted, as in eq. 10; it tests eight discs at a time. "
            "Samples lie in or on the cube of eq. 4, whose corners touch the unit sphere of the lines; discs "
            "are as large as the samples' distance. The printed and the corrected form of Theorem 1 differ "
            "visibly only for few samples.",
        ),
    )


def predicted(method: str, spread: Spread, counts: ArrayLike, ratio: float, form: str = "corrected") -> Any:
    """Tests per line by Theorem 1, or by its counterpart for samples on surfaces."""
    if method == CACHE and spread == "volume":
        return model.sphere_cache_cost(counts, 1, ratio, form=form)
    if method == CACHE:
        return model.surface_cache_cost(counts, 1, ratio)
    return model.disc_index_cost(counts, 1) if spread == "volume" else model.surface_index_cost(counts, 1)


def exponents(tests: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """(seeds,) exponents p of the growth of tests as n_P^p."""
    return np.array([power_law(counts, row)[0] for row in tests])


def cube_root(method: str, tests: np.ndarray, counts: np.ndarray) -> Verdict:
    """Whether costs grow as the cube root of the sample count."""
    slopes = exponents(tests, counts)
    sign = certain_sign(np.abs(slopes - EXPONENT) - NEAR)
    (slope,), error = mean_and_error(slopes[:, None])
    within = f" ± {error[0]:.4f} (standard error)" if error else ""
    return Verdict(
        f"The cost of the {method} grows as the cube root of the number of samples (paper, Theorem 1).",
        outcome_of(sign, wanted=-1),
        f"Tests grow as the power {slope:.3f}{within} from {counts[0]:,} to {counts[-1]:,} samples in a "
        f"volume; confirmed within {NEAR:g} of 1/3.",
    )


def constant(method: str, tests: np.ndarray, theory: np.ndarray, spread: Spread = "volume") -> Verdict:
    """Whether a formula's constant is right, at the largest number of samples."""
    over = tests / theory
    signs = [certain_sign(over[:, -1] - ALIKE), certain_sign(1 / over[:, -1] - ALIKE)]
    of = "Theorem 1" if spread == "volume" else "the cost model for surfaces (beyond the paper)"
    return Verdict(
        f"The {method} needs as many tests as {of} has it, samples {WHERE[spread]}.",
        "refuted" if 1 in signs else together([outcome_of(sign, wanted=-1) for sign in signs]),
        f"Counted over predicted tests: {over.mean(axis=0)[0]:.2f} for the fewest samples, "
        f"{over.mean(axis=0)[-1]:.2f} for the most; confirmed within a factor of {ALIKE:g}.",
    )


def logarithmic(tests: np.ndarray, counts: np.ndarray) -> Verdict:
    """Whether the cost on surfaces is a straight line over ln n_P rather than over its cube root."""
    left = {
        name: _residual(tests, axis)
        for name, axis in (("ln n_P", np.log(counts)), ("cube root", np.cbrt(counts)))
    }
    sign = certain_sign(np.log(left["ln n_P"] / left["cube root"]))
    return Verdict(
        "On surfaces the cost of the sphere cache follows the logarithm of the number of samples, not its "
        "cube root (cost model, beyond the paper).",
        outcome_of(sign, wanted=-1),
        "Root of the mean square that a straight line leaves, relative to the mean: "
        + ", ".join(f"over {name} {each.mean():.1%}" for name, each in left.items())
        + ".",
    )


def _residual(tests: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """(seeds,) RMS residual of a straight line over `axis`, relative to the mean of the tests."""
    slope, start = np.polyfit(axis, tests.T, 1)
    left = tests - (slope[:, None] * axis + start[:, None])
    return np.sqrt(np.square(left).mean(axis=1)) / tests.mean(axis=1)


def _table(tests: Tests, settings: Mapping[str, Any]) -> Table:
    rows: list[list[Cell]] = []
    for (method, spread), each in tests.items():
        mean, error = mean_and_error(each)
        theory = predicted(method, spread, settings["sample_counts"], settings["ratio"])
        for column, count in enumerate(settings["sample_counts"]):
            spread_error = None if error is None else error[column]
            rows.append([method, spread, count, mean[column], spread_error, float(theory[column])])
    columns = ("method", "samples lie in", "samples", "tests per line", "s.e. of tests per line", "theory")
    return Table("cost_scaling", columns, rows)


def _figure(method: str, tests: Tests, settings: Mapping[str, Any]) -> Figure:
    counts = settings["sample_counts"]
    curves = []
    for spread in SPREADS:
        mean, error = mean_and_error(tests[method, spread])
        curves.append(Curve(f"counted, {WHERE[spread]}", counts, mean, error))
    fine = np.geomspace(counts[0], counts[-1], 60)
    for spread in SPREADS:
        theory = predicted(method, spread, fine, settings["ratio"])
        curves.append(Curve(f"theory, {WHERE[spread]}", fine.tolist(), theory.tolist(), None, "theory"))
    tested = "sphere and disc tests" if method == CACHE else "disc tests"
    ratio = f", Q = {settings['ratio']:.3g}" if method == CACHE else ""
    return Figure(
        f"cost_scaling_{method.replace(' ', '_')}",
        f"Cost of the {method} over the number of samples, {settings['lines']:,} uniform lines{ratio}. "
        f"{averaged(settings)}",
        "samples $n_P$",
        f"{tested} per line",
        curves,
        log_x=True,
        log_y=True,
    )


EXPERIMENT = Experiment(
    name="cost-scaling",
    title="Cost over the number of samples",
    source="paper 3.1, Theorem 1",
    question="Do the sphere cache and disc indexing cost what Theorem 1 says, and grow as it says?",
    run=run,
    full={
        "seeds": [1, 2, 3, 4, 5, 6],
        "lines": 512**2,
        "sample_counts": [1_000, 3_000, 10_000, 30_000, 100_000, 300_000, 1_000_000],
        "ratio": 2 / 3,
        "min_rays": 1,  # full depth, as the formulas assume
    },
    quick={"seeds": [1, 2], "lines": 3_000, "sample_counts": [500, 2_000, 8_000]},
)
