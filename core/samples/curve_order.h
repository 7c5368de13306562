// SPDX-License-Identifier: Apache-2.0
// Order of points along a space-filling curve, so that consecutive samples lie close together
// (point sorting, paper 2.3).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/progress.h"
#include "base/vec.h"

namespace deltalux::samples {

enum class Curve : uint8_t {
  none,      ///< as given
  lebesgue,  ///< Morton, z-order
  hilbert,   ///< consecutive cells are neighbours
};

/// Indices of the points in the order in which the curve through their bounding cube, 2^21 cells
/// wide, meets them; points of one cell in the order of their `ties`, else as they are. Points must
/// be finite. Throws Cancelled.
std::vector<uint32_t> curve_order(std::span<const Vec3f> points, Curve curve,
                                  const Progress* progress = nullptr,
                                  std::span<const uint64_t> ties = {});

}  // namespace deltalux::samples
