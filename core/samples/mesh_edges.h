// SPDX-License-Identifier: Apache-2.0
// Which triangles of a mesh meet at which edges. An edge of triangle t, from its corner k to the
// next one, has the number 3 t + k.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/vec.h"

namespace deltalux::samples {

using Triangle = std::array<int64_t, 3>;  ///< numbers of points

/// Edges that two triangles run along in opposite directions, as pairs of numbers: first those of
/// neighbours among all edges with the same ends, in the order of their ends (lower, then higher)
/// and numbers, then those that are two apart, and so on. Points are below `points`.
std::pair<std::vector<int64_t>, std::vector<int64_t>> shared_edges(
    std::span<const Triangle> triangles, size_t points);

/// 1 for each edge, at least `shortest` long, that belongs to triangles with three different
/// opposite corners and more: both windings of a triangle count once.
std::vector<uint8_t> junctions(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                               double shortest);

/// 1 for each triangle with the corners of an earlier one, in whatever order.
std::vector<uint8_t> repeated_triangles(std::span<const Triangle> triangles, size_t points);

}  // namespace deltalux::samples
