# SPDX-License-Identifier: Apache-2.0
"""What a study ran on: versions, build and processor."""

from __future__ import annotations

import os
import platform
from pathlib import Path

import numpy as np

from deltalux.planning.machine import core_build
from deltalux.version import __version__

CPU_INFO = Path("/proc/cpuinfo")


def environment() -> dict[str, str | int]:
    """Versions, the core's build, and the processor, as text for a page."""
    return {
        "deltalux": __version__,
        "core build": core_build()[:12],
        "python": platform.python_version(),
        "numpy": np.__version__,
        "system": f"{platform.system()} {platform.machine()}",
        "processor": _processor(),
        "logical processors": os.cpu_count() or 1,
    }


def _processor() -> str:
    try:
        for line in CPU_INFO.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"
