# SPDX-License-Identifier: Apache-2.0
"""What every estimator of a kind promises, run on each of them."""
