# SPDX-License-Identifier: Apache-2.0
"""What a method will cost before it runs: pilots on a hundredth of the segments, and estimates."""

from .hybrid import HybridEstimate, hybrid_estimate

__all__ = ["HybridEstimate", "hybrid_estimate"]
