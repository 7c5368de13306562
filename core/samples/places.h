// SPDX-License-Identifier: Apache-2.0
// Merges points that are equal up to rounding.
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/vec.h"

namespace deltalux::samples {

/// For each point, the index of the first one in the same cell of a grid. `rounding`: width of a
/// cell, relative to the largest distance from the centre of all points along an axis; above 2^-20.
std::vector<int64_t> same_places(std::span<const Vec3d> points, double rounding);

/// Returns one point of each cell (the first), in the order of bodies and of their cells (x, y, z);
/// and for each point, the number of its cell. Body i has the points first[i] to first[i + 1] - 1;
/// its cells are `rounding` wide, relative to its largest coordinate; at least 2^-30.
std::pair<std::vector<int64_t>, std::vector<int64_t>> welded_points(std::span<const Vec3d> points,
                                                                    std::span<const int64_t> first,
                                                                    double rounding);

}  // namespace deltalux::samples
