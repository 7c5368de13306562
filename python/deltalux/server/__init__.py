# SPDX-License-Identifier: Apache-2.0
"""The viewer's server: one session, any number of pages (docs/reference/viewer-protocol.md)."""

from .hosts import is_loopback
from .viewing import View, serve, view

__all__ = ["View", "is_loopback", "serve", "view"]
