# SPDX-License-Identifier: Apache-2.0
"""Writers of small input files that tests read back."""
