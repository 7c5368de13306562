# SPDX-License-Identifier: Apache-2.0
"""Pages, tables and figures of studies, as texts and pictures; whoever asks writes them."""
