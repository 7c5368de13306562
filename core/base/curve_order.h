// SPDX-License-Identifier: Apache-2.0
// Orders points along a space-filling curve, so that consecutive samples are close together (point
// sorting, paper 2.3).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/vec.h"

namespace deltalux {

enum class Curve : uint8_t {
  none,      ///< in the given order
  lebesgue,  ///< Morton, z-order
  hilbert,   ///< consecutive cells are neighbours
};

/// Indices of the points in the order in which the curve through their bounding cube (2^21 cells
/// wide) visits them; points in one cell are ordered by `ties`, then by index. Points must be
/// finite. Throws Cancelled.
std::vector<uint32_t> curve_order(std::span<const Vec3f> points, Curve curve,
                                  const Progress* progress = nullptr,
                                  std::span<const uint64_t> ties = {});

}  // namespace deltalux
