# SPDX-License-Identifier: Apache-2.0
"""The experiments of the study, in the paper's order; each module defines one as `EXPERIMENT`."""

from __future__ import annotations

import difflib

from deltalux.errors import OptionError
from deltalux.studies.experiment import Experiment

from . import (
    amortisation,
    cache_misses,
    cost_scaling,
    curve_orders,
    disc_spacing,
    hybrid_estimate,
    incremental,
    index_choice,
    mean_rays,
    moving_object,
    radius_ratio,
    ray_map_cost,
    variance,
)

EXPERIMENTS: tuple[Experiment, ...] = tuple(
    module.EXPERIMENT
    for module in (
        variance,
        disc_spacing,
        index_choice,
        amortisation,
        cost_scaling,
        radius_ratio,
        moving_object,
        incremental,
        mean_rays,
        hybrid_estimate,
        cache_misses,
        curve_orders,
        ray_map_cost,
    )
)


def experiment(name: str) -> Experiment:
    """The experiment of that name.

    Raises
    ------
    OptionError
        For an unknown name.
    """
    names = [each.name for each in EXPERIMENTS]
    if name not in names:
        close = difflib.get_close_matches(name, names, n=1)
        hint = f"did you mean {close[0]}?" if close else f"or one of {', '.join(names)}"
        raise OptionError(f"study: found '{name}', expected 'all' or the name of an experiment; {hint}")
    return EXPERIMENTS[names.index(name)]
