# SPDX-License-Identifier: Apache-2.0
"""The verbs: one module for each, and what belongs to one verb alone."""
