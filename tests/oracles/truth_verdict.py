# SPDX-License-Identifier: Apache-2.0
"""Whether light that a session claims is true: of one scene, against the path tracer, with both errors.

Null hypothesis: every value is right to its claimed error, which comes from eight batches of paths and from
the sample's own rays. A scene is wrong if one of two numbers is:

- the mean over its points of the relative difference, beyond 2 % and 5 errors. Points share paths, so the
  claimed error of the mean is the mean of the claimed errors, as if all points erred together;
- the share of points beyond 2 % and 5 errors of their own, if it is more than a tenth.

False alarms: if all of the error were of shared paths, each number would be Student's t of 7 degrees of
freedom, |t| > 5 once in 600 scenes, where the claimed errors exceed 0.4 % (else 2 % are more than 5 of them);
of points that err independently, 5 of 48 would have to, 1e-8. Errors of rooms at default options are mostly
of the second kind. The path tracer's own error is taken from the spread of its paths; a scene that seems
wrong is traced again with twice as many.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from .path_tracer import Found, Tracer, World
from .tracer_world import Array

ERRORS, LEAST, SHARE = 5.0, 0.02, 0.1
DARK = 0.1  # of the mean; darker points count against it
NONE = 1e-9  # relative error that is as good as a claim of none
NORMAL = {0.5: 0.6745, 0.9: 1.6449}  # quantiles of |x|
FIRST, MOST = 500, 64_000  # paths of a point
MEAN_WANTED, POINT_WANTED = 0.003, 0.5  # error of the mean; errors of points, of the claimed ones


@dataclass(frozen=True)
class Verdict:
    """What a comparison found; relative differences.

    Parameters
    ----------
    bias, allowed : mean of the differences; 5 errors of it, or 2 % if that is more
    outside : share of points beyond 2 % and 5 errors
    claimed, traced : medians of the errors that the session claims, and that the path tracer has
    beyond : (n,) |difference| / error, of both together
    wrong, lies : lies: wrong with a claimed error of 0
    """

    bias: float
    allowed: float
    outside: float
    claimed: float
    traced: float
    beyond: Array
    wrong: bool
    lies: bool

    def over_normal(self, share: float) -> float:
        """The quantile of |difference| / error over that of the normal distribution."""
        return float(np.quantile(self.beyond, share) / NORMAL[share])


def judge(light: Array, claimed: Array, found: Found, dark: float = 0.0) -> Verdict:
    """Compare (n,) values and their claimed errors with what was traced.

    Parameters
    ----------
    dark : irradiance that is as good as none: it adds to what 2 % allow
    """
    scale = np.maximum(found.mean, DARK * found.mean.mean()) + dark / LEAST
    scale = np.maximum(scale, np.finfo(float).tiny)
    difference, own, traced = (light - found.mean) / scale, claimed / scale, found.standard_error / scale
    error = np.sqrt(own**2 + traced**2)
    of_mean = float(np.hypot(own.mean(), np.sqrt((traced**2).mean() / len(light))))
    far = abs(difference) > np.maximum(ERRORS * error, LEAST)
    allowed, bias, outside = max(ERRORS * of_mean, LEAST), float(difference.mean()), float(far.mean())
    wrong = abs(bias) > allowed or outside > SHARE
    unclaimed = own <= NONE
    lies = wrong and (bool(unclaimed.all()) or float((far & unclaimed).mean()) > SHARE)
    beyond = np.divide(abs(difference), error, out=np.zeros_like(error), where=error > 0)
    return Verdict(
        bias, allowed, outside, float(np.median(own)), float(np.median(traced)), beyond, wrong, lies
    )


def trace_and_judge(
    world: World,
    places: tuple[Array, Array],
    light: Array,
    claimed: Array,
    *,
    seed: int,
    seconds: float,
    dark: float = 0.0,
) -> tuple[Verdict, Found]:
    """Trace until the path tracer's error is small beside what is claimed, or for about `seconds`."""
    more = _Paths(Tracer(world), places, seed)
    found = more(FIRST)
    start = time.process_time()

    def wanted() -> bool:
        scale = np.maximum(found.mean, DARK * found.mean.mean()) + dark / LEAST
        if not (scale > 0).all():
            return found.paths < 4 * FIRST
        own, traced = np.maximum(claimed, 0.002 * scale) / scale, found.standard_error / scale
        of_mean = np.sqrt((traced**2).mean() / len(scale))
        return of_mean > MEAN_WANTED or float(np.median(traced / own)) > POINT_WANTED

    while wanted() and found.paths < MOST and time.process_time() - start < seconds / 2:
        found = found.joined(more(found.paths))
    verdict = judge(light, claimed, found, dark)
    if verdict.wrong:
        found = found.joined(more(found.paths))
        verdict = judge(light, claimed, found, dark)
    return verdict, found


class _Paths:
    """Independent estimates of the same light, each with random numbers of its own."""

    def __init__(self, tracer: Tracer, places: tuple[Array, Array], seed: int) -> None:
        self._tracer, self._places, self._seed, self._calls = tracer, places, seed, 0

    def __call__(self, paths: int) -> Found:
        self._calls += 1
        return self._tracer.irradiance(*self._places, paths, self._seed + (self._calls << 32))
