# SPDX-License-Identifier: Apache-2.0
"""What pages draw: geometry, and values at its vertices."""
