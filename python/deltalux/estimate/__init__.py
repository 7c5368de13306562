# SPDX-License-Identifier: Apache-2.0
"""Estimators on arrays: every method on the same segments and samples."""

from .disc_methods import brute_force, disc_index
from .sphere_cache import sphere_cache

__all__ = ["brute_force", "disc_index", "sphere_cache"]
