# SPDX-License-Identifier: Apache-2.0
"""Display meshes: a scene's triangles refined, cut where surfaces meet, and cast at."""
