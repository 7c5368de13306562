# SPDX-License-Identifier: Apache-2.0
"""Tests of the viewer's server and page."""
