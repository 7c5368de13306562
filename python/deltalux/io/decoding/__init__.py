# SPDX-License-Identifier: Apache-2.0
"""Third-party decoders of compressed geometry, in a process of their own."""
