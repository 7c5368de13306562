// SPDX-License-Identifier: Apache-2.0
// Groups nearby vertices of a mesh.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

/// Returns the group number of each vertex. Two vertices are in the same group if edges of
/// triangles lead from one to the other through vertices of the same kind in the same cube. Cubes
/// are `edge` wide; the grid is shifted by `offset` (in units of `edge`) below the origin. Groups
/// are numbered in the order of their first vertices.
std::vector<int32_t> groups_in_cubes(std::span<const Vec3d> vertices,
                                     std::span<const Triangle> triangles,
                                     std::span<const int64_t> kind, double edge, double offset);

}  // namespace deltalux::samples
