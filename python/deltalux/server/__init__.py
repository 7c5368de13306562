# SPDX-License-Identifier: Apache-2.0
"""The viewer's server: one session, any number of pages (docs/reference/viewer-protocol.md)."""
