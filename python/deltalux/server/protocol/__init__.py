# SPDX-License-Identifier: Apache-2.0
"""What goes over the wire (docs/reference/viewer-protocol.md): requests, messages, frames, arrays."""
