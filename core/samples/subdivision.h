// SPDX-License-Identifier: Apache-2.0
// Subdivides triangles without cracks: whether and where an edge is split depends on its two ends
// only, so that the triangles on both sides agree.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

using Marks = std::array<bool, 3>;  ///< of a triangle's edges

/// Triangles, and the index of the one that each comes from.
struct Pieces {
  std::vector<Triangle> triangles;
  std::vector<int64_t> source;
};

/// Replaces each triangle with one, two or three marked edges by two, three or four parts, which
/// keep its source. `middle`: the midpoint of each marked edge. Parts of triangles with one marked
/// edge come first, then those with two, then those with three; within these, all first parts, then
/// all second parts, and so on.
Pieces split_marked(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                    std::span<const int64_t> source, std::span<const Marks> marked,
                    std::span<const Triangle> middle);

struct Subdivided {
  std::vector<Vec3d> added;  ///< numbered after the given points
  Pieces pieces;             ///< in the order of the original triangles, winding preserved
};

/// Bisects edges until none is longer than the square root of `squared_limit`. Returns nothing if
/// that takes more than `most` points.
std::optional<Subdivided> split_long_edges(std::span<const Vec3d> points,
                                           std::span<const Triangle> triangles,
                                           double squared_limit, size_t most);
/// How many points split_long_edges() would add.
std::optional<size_t> count_halved_edges(std::span<const Vec3d> points,
                                         std::span<const Triangle> triangles, double squared_limit,
                                         size_t most);

}  // namespace deltalux::samples
