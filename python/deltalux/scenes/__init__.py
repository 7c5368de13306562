# SPDX-License-Identifier: Apache-2.0
"""Generated demonstration scenes: deterministic, each with a camera "main" and something to move."""

from .office import office

__all__ = ["office"]
