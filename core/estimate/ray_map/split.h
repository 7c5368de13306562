// SPDX-License-Identifier: Apache-2.0
// Where to split a leaf of a ray map: by the queries that visit it.
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

/// The plane that leaves the fewest tests of segments, when these meet a half of the cell (within
/// `bounds`) with the probability of its share of the surface. A split pays once the tests that it
/// would have saved all queries so far, `visits`, cost as much as it does; `split_cost` is that of
/// sorting a segment into halves, in tests of a segment.
SplitChoice choose_split(std::span<const Box> boxes, std::span<const uint32_t> queries,
                         const Box& cell, const Box& bounds, uint32_t visits, float split_cost);

}  // namespace deltalux::estimate
