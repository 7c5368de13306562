// SPDX-License-Identifier: Apache-2.0
// The fixed directions in which samples look around.
#pragma once
#include <array>
#include <vector>

#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::gather {

/// Cosine-distributed: Sobol' points, their digits shifted at random by sample, so that each square
/// of the strata holds as many for every sample.
class Directions {
 public:
  Directions(uint32_t count, uint64_t seed) : key_(mix64(seed ^ 0x6761746865722121ull)) {
    for (uint32_t i = 0; i < count; ++i)
      points_.push_back({sobol::point(i, 0), sobol::point(i, 1)});
  }
  uint32_t count() const { return uint32_t(points_.size()); }
  /// Of ray `ray` of `sample`, about the unit normal `n`.
  Vec3f operator()(uint32_t sample, uint32_t ray, Vec3f n) const {
    const uint64_t shift = combine(key_, sample);
    const auto& p = points_[ray];
    return trace::cosine_direction(n, unit_float32(p[0] ^ uint32_t(shift)),
                                   unit_float32(p[1] ^ uint32_t(shift >> 32)));
  }

 private:
  uint64_t key_;
  std::vector<std::array<uint32_t, 2>> points_;
};

}  // namespace deltalux::gather
