# SPDX-License-Identifier: Apache-2.0
"""Summaries and reports of a bake."""

from .comparison import compare
from .page import Section, page
from .summary import SetSummary, relative_error, summarise

__all__ = ["Section", "SetSummary", "compare", "page", "relative_error", "summarise"]
