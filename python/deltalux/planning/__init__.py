# SPDX-License-Identifier: Apache-2.0
"""What a method will cost before it runs: pilots on a hundredth of the segments, and estimates."""

from .arrays import MethodCost, predict
from .hybrid import HybridEstimate, hybrid_estimate
from .machine import machine_constants

__all__ = ["HybridEstimate", "MethodCost", "hybrid_estimate", "machine_constants", "predict"]
