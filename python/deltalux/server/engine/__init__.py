# SPDX-License-Identifier: Apache-2.0
"""What follows the wanted state: the one thread that uses the session, its tasks and its work."""

from .engine import Engine

__all__ = ["Engine"]
