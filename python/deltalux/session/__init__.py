# SPDX-License-Identifier: Apache-2.0
"""Sessions: bake once, edit, update exactly, and read light anywhere."""

from .session import Session

__all__ = ["Session"]
