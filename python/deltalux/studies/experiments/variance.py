# SPDX-License-Identifier: Apache-2.0
"""`variance`: error against paths, radius and time, its prediction, and bias (paper 1 and 2.1)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from scipy.special import ndtri

import deltalux.scenes
from deltalux.estimate import disc_index
from deltalux.samples import Samples
from deltalux.scene import Material, Mesh, PointLight, Scene
from deltalux.segments import Progress, trace
from deltalux.studies.curves import agreement, power_law
from deltalux.studies.experiment import Experiment, Figure, Findings, Verdict
from deltalux.studies.progress_parts import Steps
from deltalux.studies.repeated_bakes import CHANNEL, RepeatedBakes, enough_seeds, repeated_bakes
from deltalux.studies.repeats import together
from deltalux.studies.seeds import Done, by_seed
from deltalux.studies.series import Series, series_table

HEIGHT = 1.0  # metres from the floor to the bulb
SLOPE, AGREE = 0.05, 0.1  # largest accepted deviation of an exponent, of a ratio of variances
FALSE_ALARMS = 0.001
PATHS, RADIUS = "light paths", "disc radius (m)"


def run(settings: Mapping[str, Any], progress: Progress | None = None) -> Findings:
    """Bake the Cornell box many times, and a floor under a bulb, whose irradiance is known."""
    settings = {**settings, "seeds": enough_seeds(settings["seeds"])}
    paths, radii = (np.array(settings[name], float) for name in ("paths", "radii"))
    wide = np.array(settings["bias_radii"], float)
    points = dict.fromkeys(
        [(count, settings["radius"]) for count in settings["paths"]]
        + [(settings["paths"][-1], radius) for radius in settings["radii"]]
    )
    steps = Steps(progress, len(points) * len(settings["seeds"]) + len(settings["bias_seeds"]))
    scene, bakes = deltalux.scenes.cornell_box(), {}
    for count, radius in points:
        bakes[count, radius] = repeated_bakes(scene, count, radius, settings, steps)
    by_paths = [bakes[count, settings["radius"]] for count in settings["paths"]]
    by_radius = [bakes[settings["paths"][-1], radius] for radius in settings["radii"]]
    found = Series.of_seeds("measured", "1", _floor_bias(wide, settings, steps))
    exact = disc_bias(wide)
    every = list(bakes.values())
    seconds = np.array([one.time.seconds for one in by_paths])
    return Findings(
        [
            _spread_table("variance_paths", PATHS, paths, by_paths),
            _spread_table("variance_radius", RADIUS, radii, by_radius),
            series_table("variance_bias", RADIUS, wide, [found, *_bias_theory(wide)]),
        ],
        _figures(paths, radii, wide, by_paths, by_radius, found, settings),
        [
            slope_verdict("the number of paths", -0.5, paths, [one.error() for one in by_paths]),
            slope_verdict("the radius", -1.0, radii, [one.error() for one in by_radius]),
            slope_verdict("time", -0.5, seconds, [one.error() for one in by_paths]),
            prediction_verdict("A session's standard error", [one.ratio("reported") for one in every]),
            prediction_verdict(
                "A Poisson law (sum of squared powers)", [one.ratio("poisson") for one in every]
            ),
            bias_verdict(wide, found, exact),
            quadratic_verdict(wide, found),
        ],
        [
            "A path that crosses a disc twice makes its crossings dependent, which the Poisson law does not "
            "see; low-discrepancy numbers of the first bounces spread less than the law supposes.",
        ],
    )


# ---- measurements -------------------------------------------------------------------------------


def _floor_bias(radius: np.ndarray, settings: Mapping[str, Any], steps: Steps) -> np.ndarray:
    """(seeds, radii) relative bias under a bulb over a black floor."""
    corners = HEIGHT * np.array([(-4, 0, -4), (-4, 0, 4), (4, 0, 4), (4, 0, -4)])
    floor = Mesh("floor", corners, [(0, 1, 2), (0, 2, 3)], "black")
    bulb = PointLight("bulb", (0, HEIGHT, 0), intensity=(1, 1, 1))
    scene = Scene([floor], [Material("black", (0, 0, 0))], [bulb], unit="W/m2")
    samples = Samples(np.zeros((len(radius), 3)), (0, 1, 0), radius)

    def bias(seed: int, done: Done) -> np.ndarray:
        segments = trace(scene, settings["bias_paths"], seed, threads=settings.get("threads"))
        # Segments end in the floor, where the discs lie: with exact ends, rounding would decide crossings.
        estimate = disc_index(segments, samples, segment_end="bounded")
        done()
        return estimate.irradiance[:, CHANNEL] * HEIGHT**2 - 1

    return np.array(by_seed(bias, settings["bias_seeds"], steps))


def disc_bias(radius: np.ndarray) -> np.ndarray:
    """Relative bias of the mean over a disc under the bulb: 2 (h/d)² (1 - h / (h² + d²)^½) - 1."""
    ratio = HEIGHT / radius
    return 2 * ratio**2 * (1 - HEIGHT / np.hypot(HEIGHT, radius)) - 1


def laplacian_bias(radius: np.ndarray) -> np.ndarray:
    """First term of `disc_bias`, d² ∇²E / 8 over E: -(3/4) (d/h)²."""
    return -0.75 * (radius / HEIGHT) ** 2


# ---- verdicts -----------------------------------------------------------------------------------


def slope_verdict(over: str, exponent: float, x: np.ndarray, error: Sequence[float]) -> Verdict:
    """Whether the error falls as `x` to the power `exponent`, as for independent crossings."""
    found, spread = power_law(x, error)
    return Verdict(
        f"The error falls as the power {exponent:g} of {over}.",
        agreement(found, spread, exponent, SLOPE),
        f"Exponent {found:.3f} ± {spread:.3f}, error from {max(error):.1%} to {min(error):.1%}; within "
        f"{SLOPE:g} it agrees.",
    )


def prediction_verdict(what: str, ratios: Sequence[tuple[float, float]]) -> Verdict:
    """Whether predicted and observed variances agree in all runs, within their errors."""
    values, errors = np.array(ratios).T
    outcome = together([agreement(value, error, 1, AGREE) for value, error in ratios])
    return Verdict(
        f"{what} predicts the spread over seeds.",
        outcome,
        f"Predicted over observed variance: {values.min():.2f} to {values.max():.2f}, known to "
        f"± {errors.max():.2f}; within {AGREE:.0%} they agree.",
    )


def bias_verdict(radius: np.ndarray, found: Series, exact: np.ndarray) -> Verdict:
    """Whether the bias agrees with its closed form, tested at all radii together."""
    claim = "Under a bulb the bias is that of the exact mean over the disc."
    if found.error is None:
        return Verdict(claim, "open", "A single seed does not tell its spread.")
    scores = np.abs(found.values - exact) / found.error
    allowed = float(-ndtri((1 - (1 - FALSE_ALARMS) ** (1 / len(radius))) / 2))
    return Verdict(
        claim,
        "confirmed" if scores.max() < allowed else "refuted",
        f"Null hypothesis: equal means at all {len(radius)} radii; largest deviation {scores.max():.1f} "
        f"standard errors, {allowed:.1f} allowed (false-alarm rate {FALSE_ALARMS:g}); bias "
        f"{found.values[0]:+.2%} at d = {radius[0]:g} h, {found.values[-1]:+.1%} at {radius[-1]:g} h.",
    )


def quadratic_verdict(radius: np.ndarray, found: Series) -> Verdict:
    """Whether d² ∇²E / 8 equals the measured bias where that is small but exceeds its error."""
    claim = f"Where the bias is below {AGREE:.0%} it is d² ∇²E / 8, hence proportional to d²."
    error = np.zeros(len(radius)) if found.error is None else found.error
    small = (np.abs(found.values) < AGREE) & (np.abs(found.values) > 5 * error)
    if not small.any():
        return Verdict(claim, "open", "No radius has a bias that is small and known.")
    ratio = found.values[small] / laplacian_bias(radius[small])
    agrees = bool((np.abs(ratio - 1) <= AGREE).all())
    return Verdict(
        claim,
        "confirmed" if agrees else "refuted",
        f"Measured bias over d² ∇²E / 8: {ratio.min():.2f} to {ratio.max():.2f} for d from "
        f"{radius[small].min():g} h to {radius[small].max():g} h; within {AGREE:.0%} it agrees.",
    )


# ---- tables and figures -------------------------------------------------------------------------


def _spread(runs: Sequence[RepeatedBakes]) -> list[Series]:
    """Relative errors: over seeds, and as predicted."""
    error = np.array([one.error() for one in runs])
    return [
        Series("measured over seeds", "1", error, np.array([one.error_of_error() for one in runs])),
        Series(
            "reported by sessions", "1", np.array([one.expected("reported") for one in runs]), theory=True
        ),
        Series("Poisson law", "1", np.array([one.expected("poisson") for one in runs]), theory=True),
    ]


def _spread_table(name: str, column: str, x: np.ndarray, runs: Sequence[RepeatedBakes]) -> Any:
    ratios = []
    for what in ("reported", "poisson"):
        values, errors = np.array([one.ratio(what) for one in runs]).T
        ratios.append(Series(f"{what} / measured variance", "1", values, errors))
    time = Series.of_times("full frame", [one.time for one in runs])
    return series_table(name, column, x, [*_spread(runs), *ratios, time])


def _bias_theory(radius: np.ndarray) -> list[Series]:
    return [
        Series("exact mean over the disc", "1", disc_bias(radius), theory=True),
        Series("d² ∇²E / 8", "1", laplacian_bias(radius), theory=True),
    ]


def _figures(
    paths: np.ndarray,
    radii: np.ndarray,
    wide: np.ndarray,
    by_paths: Sequence[RepeatedBakes],
    by_radius: Sequence[RepeatedBakes],
    bias: Series,
    settings: Mapping[str, Any],
) -> list[Figure]:
    seeds = f"{len(settings['seeds'])} seeds ({settings['seeds'][0]} to {settings['seeds'][-1]})"
    box = f"Cornell box, {settings['samples']} samples, {seeds}; error bars: jackknife over seeds"
    seconds = np.array([one.time.seconds for one in by_paths])
    return [
        Figure(
            "variance_paths",
            f"RMS error over mean irradiance, d = {settings['radius']:g} m. {box}.",
            PATHS,
            "relative error",
            [series.curve(paths) for series in _spread(by_paths)],
            log_x=True,
            log_y=True,
        ),
        Figure(
            "variance_radius",
            f"RMS error over mean irradiance, {settings['paths'][-1]:,} paths. {box}.",
            RADIUS,
            "relative error",
            [series.curve(radii) for series in _spread(by_radius)],
            log_x=True,
            log_y=True,
        ),
        Figure(
            "variance_time",
            f"RMS error over mean irradiance against processor time of a full frame, one thread. {box}.",
            "time (s)",
            "relative error",
            [_spread(by_paths)[0].curve(seconds)],
            log_x=True,
            log_y=True,
        ),
        Figure(
            "variance_bias",
            f"Relative bias under a bulb {HEIGHT:g} m above a black floor, {settings['bias_paths']:,} paths; "
            f"mean and standard error over {len(settings['bias_seeds'])} seeds.",
            RADIUS,
            "− relative bias",
            [
                Series(s.label, "1", -s.values, s.error, s.theory).curve(wide)
                for s in (bias, *_bias_theory(wide))
            ],
            log_x=True,
            log_y=True,
        ),
    ]


EXPERIMENT = Experiment(
    name="variance",
    title="Error and bias",
    source="paper 1 and 2.1",
    question="How do error and bias depend on paths, radius and time, and is the error predicted correctly?",
    run=run,
    full={
        "seeds": list(range(1, 25)),
        "samples": 500,
        "paths": [2500, 10_000, 40_000, 160_000],
        "radius": 0.2,
        "radii": [0.05, 0.1, 0.2, 0.4],
        "bias_seeds": list(range(1, 33)),
        "bias_paths": 1_000_000,
        "bias_radii": [0.1, 0.2, 0.3, 0.45, 0.7, 1.0],
    },
    quick={
        "seeds": list(range(1, 7)),
        "samples": 100,
        "paths": [1000, 3000, 9000],
        "radii": [0.1, 0.2, 0.4],
        "bias_seeds": list(range(1, 7)),
        "bias_paths": 30_000,
        "bias_radii": [0.3, 0.6, 1.0],
    },
    timed=True,
)
