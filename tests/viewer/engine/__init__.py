# SPDX-License-Identifier: Apache-2.0
"""The engine: what it follows, bakes, refines and tells."""
