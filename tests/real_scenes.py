# SPDX-License-Identifier: Apache-2.0
"""Where real scenes are, which are no part of the repository: a folder beside it, or what is named."""

from __future__ import annotations

import os
from pathlib import Path

FOLDER = Path(os.environ.get("DELTALUX_SCENES") or Path(__file__).parents[2] / "shared" / "scenes")
