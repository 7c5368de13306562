# SPDX-License-Identifier: Apache-2.0
"""Fuzz targets: programs that feed mutated files to the readers."""
