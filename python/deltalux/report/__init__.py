# SPDX-License-Identifier: Apache-2.0
"""Summaries and reports of a bake."""

from .summary import SetSummary, summarise

__all__ = ["SetSummary", "summarise"]
