# SPDX-License-Identifier: Apache-2.0
"""Estimators on arrays: every method on the same segments and samples."""

from .disc_methods import brute_force, disc_index
from .ray_map import RayMap, ray_map
from .sphere_cache import sphere_cache

__all__ = ["RayMap", "brute_force", "disc_index", "ray_map", "sphere_cache"]
