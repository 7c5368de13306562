// SPDX-License-Identifier: Apache-2.0
// Means of ever larger squares of an image's texels.
#pragma once
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace deltalux::surfaces {

/// Level k has the linear mean of each square of 2^k × 2^k texels; squares at the right and lower
/// edges are cut off. Level 0 is not kept. The highest level is one square.
class Mipmap {
 public:
  /// `colour(column, row)`: of a texel, linear.
  template <class Colour>
  Mipmap(uint32_t width, uint32_t height, const Colour& colour);
  uint32_t levels() const { return uint32_t(levels_.size()); }
  /// The mean of a square, 1 <= level <= levels().
  Vec3f at(uint32_t level, size_t column, size_t row) const {
    const Level& own = levels_[level - 1];
    return own.mean[row * own.across + column];
  }
  size_t bytes() const {
    size_t sum = 0;
    for (const Level& own : levels_) sum += own.mean.capacity() * sizeof(Vec3f);
    return sum;
  }

 private:
  struct Level {
    size_t across;
    std::vector<Vec3f> mean;
  };
  std::vector<Level> levels_;
};

template <class Colour>
Mipmap::Mipmap(uint32_t width, uint32_t height, const Colour& colour) {
  // Sums of the level below, and how many texels they are of.
  size_t across = width, down = height;
  std::vector<Vec3d> sum, below;
  for (uint32_t k = 1; k == 1 || across * down > 1; ++k) {
    const size_t wide = (across + 1) / 2, high = (down + 1) / 2;
    sum.assign(wide * high, {});
    for (size_t row = 0; row < down; ++row)
      for (size_t column = 0; column < across; ++column) {
        Vec3d& own = sum[row / 2 * wide + column / 2];
        own = own + (k == 1 ? Vec3d(colour(column, row)) : below[row * across + column]);
      }
    Level level{wide, {}};
    level.mean.reserve(sum.size());
    const uint64_t side = uint64_t(1) << k;
    for (size_t row = 0; row < high; ++row)
      for (size_t column = 0; column < wide; ++column) {
        const uint64_t texels = std::min<uint64_t>(side, width - column * side) *
                                std::min<uint64_t>(side, height - row * side);
        level.mean.push_back(Vec3f(sum[row * wide + column] * (1.0 / double(texels))));
      }
    levels_.push_back(std::move(level));
    below.swap(sum);
    across = wide, down = high;
  }
}

}  // namespace deltalux::surfaces
