// SPDX-License-Identifier: Apache-2.0
// Crack-free subdivision of triangles: whether and where an edge is cut depends on its two ends
// alone, so that triangles on both sides of it agree.
#pragma once
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

using Marks = std::array<bool, 3>;  ///< of a triangle's edges

/// Triangles, and the number of what each comes from.
struct Pieces {
  std::vector<Triangle> triangles;
  std::vector<int64_t> source;
};

/// Each triangle, one or more of whose edges are marked, replaced by two, three or four parts with
/// its source. `middle`: the point on each marked edge. First come the parts of those with one
/// marked edge, then of two, then of three; all first parts of them, all second ones, and so on.
Pieces split_marked(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                    std::span<const int64_t> source, std::span<const Marks> marked,
                    std::span<const Triangle> middle);

struct Subdivided {
  std::vector<Vec3d> added;  ///< numbered after the given points
  Pieces pieces;             ///< in the order of the triangles that they come from, winding kept
};

/// Halves edges until none is longer than the root of `squared_limit`. Nothing where that takes
/// more than `most` points.
std::optional<Subdivided> split_long_edges(std::span<const Vec3d> points,
                                           std::span<const Triangle> triangles,
                                           double squared_limit, size_t most);
/// How many points it would add.
std::optional<size_t> count_halved_edges(std::span<const Vec3d> points,
                                         std::span<const Triangle> triangles, double squared_limit,
                                         size_t most);

}  // namespace deltalux::samples
