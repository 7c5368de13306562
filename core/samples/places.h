// SPDX-License-Identifier: Apache-2.0
// Points that are in one place but for rounding.
#pragma once
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "base/vec.h"

namespace deltalux::samples {

/// Of each point the number of the first one in the same cell of a grid around the middle of all.
/// `rounding`: width of a cell, of the largest distance from there along an axis; above 2^-20.
std::vector<int64_t> same_places(std::span<const Vec3d> points, double rounding);

/// One of the points in each cell, the first, in the order of bodies and of their cells (x, y, z);
/// and of each point the number of its cell. Body i has the points from first[i] to first[i + 1],
/// and cells `rounding` wide, of its largest coordinate; not below 2^-30.
std::pair<std::vector<int64_t>, std::vector<int64_t>> welded_points(std::span<const Vec3d> points,
                                                                    std::span<const int64_t> first,
                                                                    double rounding);

}  // namespace deltalux::samples
