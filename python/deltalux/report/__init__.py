# SPDX-License-Identifier: Apache-2.0
"""Summaries and reports of a bake."""

from .claimed_error import ClaimedError, advice, claimed_error
from .comparison import compare
from .page import Section, page
from .plausible import light_doubt
from .summary import SetSummary, summarise

__all__ = [
    "ClaimedError",
    "Section",
    "SetSummary",
    "advice",
    "claimed_error",
    "compare",
    "light_doubt",
    "page",
    "summarise",
]
