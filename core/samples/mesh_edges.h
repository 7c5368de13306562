// SPDX-License-Identifier: Apache-2.0
// Finds which triangles of a mesh share which edges. The edge of triangle t from its corner k to
// the next one has the index 3 t + k.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/vec.h"

namespace deltalux::samples {

using Triangle = std::array<int64_t, 3>;  ///< indices of points

/// Edges that two triangles traverse in opposite directions, as pairs of edge indices: first those
/// that are neighbours in the list of all edges with the same ends (sorted by lower end, higher end
/// and index), then those two apart in it, and so on. All points are below `points`.
std::pair<std::vector<int64_t>, std::vector<int64_t>> shared_edges(
    std::span<const Triangle> triangles, size_t points);

/// 1 for each edge of at least length `shortest` whose triangles have three or more different
/// opposite corners; a triangle and its reversed copy count once.
std::vector<uint8_t> junctions(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                               double shortest);

/// 1 for each triangle that has the same corners as an earlier one, in any order.
std::vector<uint8_t> repeated_triangles(std::span<const Triangle> triangles, size_t points);

}  // namespace deltalux::samples
