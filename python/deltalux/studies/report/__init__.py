# SPDX-License-Identifier: Apache-2.0
"""Pages, tables and figures of studies, as texts and pictures; the caller writes the files."""
