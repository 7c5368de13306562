# SPDX-License-Identifier: Apache-2.0
"""The server towards the network: HTTP, WebSocket, who may connect, what is logged."""
