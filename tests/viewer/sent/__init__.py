# SPDX-License-Identifier: Apache-2.0
"""What is sent: messages, geometry, textures, values."""
