# SPDX-License-Identifier: Apache-2.0
"""Tests of sessions whose paths are shared among processes."""
