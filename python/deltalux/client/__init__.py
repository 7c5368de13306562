# SPDX-License-Identifier: Apache-2.0
"""Edits from Python a session that another process serves (docs/reference/serve.md)."""

from .client import Client, connect

__all__ = ["Client", "connect"]
