# SPDX-License-Identifier: Apache-2.0
"""A session that another process serves, edited from Python (docs/reference/serve.md)."""

from .client import Client, connect

__all__ = ["Client", "connect"]
