# SPDX-License-Identifier: Apache-2.0
"""What a study ran on: versions, build and processor."""

from __future__ import annotations

import hashlib
import os
import platform
from functools import cache
from pathlib import Path

import numpy as np

from deltalux import _core
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


@cache
def core_build() -> str:
    """Digest of the compiled core."""
    return hashlib.sha256(Path(_core.__file__).read_bytes()).hexdigest()


def _processor() -> str:
    try:
        for line in CPU_INFO.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or "unknown"
