# SPDX-License-Identifier: Apache-2.0
"""Generated demonstration scenes: deterministic, each with a camera "main" and something to move."""

from .atrium import atrium
from .cornell_box import cornell_box
from .expo import expo
from .office import office

__all__ = ["atrium", "cornell_box", "expo", "office"]
