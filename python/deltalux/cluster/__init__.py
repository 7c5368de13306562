# SPDX-License-Identifier: Apache-2.0
"""Bakes and edits shared among processes and machines, by Dask; needs the extra `cluster`."""

from .session import ClusterSession

__all__ = ["ClusterSession"]
