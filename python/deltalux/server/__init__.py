# SPDX-License-Identifier: Apache-2.0
"""The viewer's server: one session, any number of pages (docs/reference/viewer-protocol.md)."""

from .viewing import View, serve, view
from .web.hosts import is_loopback

__all__ = ["View", "is_loopback", "serve", "view"]
