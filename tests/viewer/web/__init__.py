# SPDX-License-Identifier: Apache-2.0
"""The server towards the network: who connects, and how it starts and ends."""
