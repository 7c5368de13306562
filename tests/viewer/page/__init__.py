# SPDX-License-Identifier: Apache-2.0
"""The real page in a real browser over the real server and engine."""
