# SPDX-License-Identifier: Apache-2.0
"""Wavefront OBJ, with its MTL files, to Scene."""

from .reader import load_obj

__all__ = ["load_obj"]
