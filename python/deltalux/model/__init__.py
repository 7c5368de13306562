# SPDX-License-Identifier: Apache-2.0
"""The paper's cost model as functions: every equation, as printed and corrected, over arrays.

Source: García, Ureña, Lastra, Montes, Revelles, A study of incremental update of global illumination
algorithms, WSCG 2007. `EQUATIONS` maps its numbers to functions. Where an equation has a slip, or leaves
a choice open, `form` selects "corrected" (default), "printed" or "spacing". All arguments broadcast;
t and u default to 1, so that results count tests.
"""

from .cache_costs import (
    best_ratio,
    cache_constant,
    grid_inner_cost,
    grid_radius,
    grid_spacing,
    inner_cost,
    rebuild_cost,
    sphere_cache_cost,
)
from .index_costs import deep_index_cost, disc_index_cost, index_depth
from .measured import measured_cache_tests, measured_crossover
from .moving_update import crossover, moving_cache_cost, moving_cost_ratio, moving_index_cost
from .ray_map import ray_map_cost
from .spheres import (
    divided_share,
    levels,
    levels_above_disc,
    limited_rebuilds,
    meeting_probability,
    rays_in_sphere,
    rebuild_time,
    rebuilds,
    sphere_radius,
)
from .static_update import affected_rays, static_cache_cost, static_cache_limit, static_index_cost
from .surfaces import (
    surface_cache_cost,
    surface_crossover,
    surface_index_cost,
    surface_inner_cost,
    surface_levels,
    surface_rebuild_cost,
    surface_rebuilds,
)

# Eq. 16 and 17 set this ratio to 1; eq. 7 is eq. 8 with traversal=True.
EQUATIONS = {
    1: sphere_cache_cost,
    2: inner_cost,
    3: rebuild_cost,
    4: grid_radius,
    5: grid_spacing,
    6: grid_inner_cost,
    7: deep_index_cost,
    8: deep_index_cost,
    9: index_depth,
    10: disc_index_cost,
    11: affected_rays,
    12: static_cache_cost,
    13: static_cache_limit,
    14: static_index_cost,
    15: moving_cache_cost,
    16: moving_cost_ratio,
    17: moving_cost_ratio,
    18: crossover,
}

__all__ = [
    "EQUATIONS",
    "affected_rays",
    "best_ratio",
    "cache_constant",
    "crossover",
    "deep_index_cost",
    "disc_index_cost",
    "divided_share",
    "grid_inner_cost",
    "grid_radius",
    "grid_spacing",
    "index_depth",
    "inner_cost",
    "levels",
    "levels_above_disc",
    "limited_rebuilds",
    "measured_cache_tests",
    "measured_crossover",
    "meeting_probability",
    "moving_cache_cost",
    "moving_cost_ratio",
    "moving_index_cost",
    "ray_map_cost",
    "rays_in_sphere",
    "rebuild_cost",
    "rebuild_time",
    "rebuilds",
    "sphere_cache_cost",
    "sphere_radius",
    "static_cache_cost",
    "static_cache_limit",
    "static_index_cost",
    "surface_cache_cost",
    "surface_crossover",
    "surface_index_cost",
    "surface_inner_cost",
    "surface_levels",
    "surface_rebuild_cost",
    "surface_rebuilds",
]
