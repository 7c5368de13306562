# SPDX-License-Identifier: Apache-2.0
"""Environment of a study: versions, build and processor."""

from __future__ import annotations

import os
import platform

import numpy as np

from deltalux.planning.machine import core_build, processor
from deltalux.version import __version__


def environment() -> dict[str, str | int]:
    """Versions, the core's build, and the processor, as text for a page."""
    return {
        "deltalux": __version__,
        "core build": core_build()[:12],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.machine()}",
        "processor": processor(),
        "logical processors": os.cpu_count() or 1,
    }
