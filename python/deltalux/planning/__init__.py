# SPDX-License-Identifier: Apache-2.0
"""Predicted costs of a method before it runs: pilots on a hundredth of the segments, and estimates."""

from .arrays import MethodCost, predict
from .hybrid import HybridEstimate, hybrid_estimate
from .machine import is_calibrated, machine_constants
from .parts import GatherPlan, MethodPlan, PartPlan, Plan, read_plan
from .planner import plan

__all__ = [
    "GatherPlan",
    "HybridEstimate",
    "MethodCost",
    "MethodPlan",
    "PartPlan",
    "Plan",
    "hybrid_estimate",
    "is_calibrated",
    "machine_constants",
    "plan",
    "predict",
    "read_plan",
]
