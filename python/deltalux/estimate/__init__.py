# SPDX-License-Identifier: Apache-2.0
"""Estimators on arrays: every method on the same segments and samples."""

from .decimation import decimate
from .disc_methods import brute_force, disc_index
from .live_photon_map import PhotonMap, PhotonUpdate
from .local_linear import local_linear
from .patch_sum import PatchEstimate, PatchSum, patch_sum
from .photon_map import photon_map
from .ray_map import RayMap, ray_map
from .sphere_cache import sphere_cache

__all__ = [
    "PatchEstimate",
    "PatchSum",
    "PhotonMap",
    "PhotonUpdate",
    "RayMap",
    "brute_force",
    "decimate",
    "disc_index",
    "local_linear",
    "patch_sum",
    "photon_map",
    "ray_map",
    "sphere_cache",
]
