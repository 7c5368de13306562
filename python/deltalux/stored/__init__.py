# SPDX-License-Identifier: Apache-2.0
"""Session files: scenes, samples and sessions as parts of one, and what a file tells unopened."""
