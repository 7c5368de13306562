# SPDX-License-Identifier: Apache-2.0
"""Samples: where irradiance is asked, which places are worth it, and what lies between them."""

from .samples import Samples

__all__ = ["Samples"]
