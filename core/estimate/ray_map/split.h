// SPDX-License-Identifier: Apache-2.0
// Chooses where to split a leaf of a ray map, by the queries that visit it.
#pragma once
#include <cstdint>
#include <span>

#include "base/vec.h"

namespace deltalux::estimate {

struct SplitChoice {
  bool worth = false;
  int axis = 0;
  float plane = 0;
};

/// Finds the plane that leaves the fewest tests of segments, if the probability that a segment
/// meets a half of the cell (within `bounds`) is proportional to the half's surface area. A split
/// pays once the tests that it would have saved for all queries so far (`visits`) cost as much as
/// the split; `split_cost` is the cost of sorting a segment into halves, in tests of a segment.
SplitChoice choose_split(std::span<const Box> boxes, std::span<const uint32_t> queries,
                         const Box& cell, const Box& bounds, uint32_t visits, float split_cost);

}  // namespace deltalux::estimate
