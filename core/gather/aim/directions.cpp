// SPDX-License-Identifier: Apache-2.0
// Strata of the unit square, and the cones that contain their directions.
#include "gather/aim/directions.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace deltalux::gather {

Directions::Directions(uint32_t count, uint64_t seed) : key_(mix64(seed ^ 0x6761746865722121ull)) {
  for (uint32_t i = 0; i < count; ++i)
    points_.push_back(
        {sobol::point(i, 0), sobol::point(i, 1), sobol::point(i, 2), sobol::point(i, 3)});
  const auto stratum = [&](uint32_t ray) {
    return (points_[ray][1] >> (32 - kBits)) * kSide + (points_[ray][0] >> (32 - kBits));
  };
  rays_.resize(count);
  for (uint32_t i = 0; i < count; ++i) rays_[i] = i, ++first_[stratum(i) + 1];
  for (uint32_t i = 0; i < kStrata; ++i) first_[i + 1] += first_[i];
  std::stable_sort(rays_.begin(), rays_.end(),
                   [&](uint32_t a, uint32_t b) { return stratum(a) < stratum(b); });
}

Directions::Strata::Strata() {
  constexpr uint32_t kSteps = 16;  // along a stratum's side
  const auto at = [&](uint32_t i, uint32_t a, uint32_t b) {
    const float step = 1.0f / (kSide * kSteps);
    return cosine_direction({0, 0, 1}, float((i % kSide) * kSteps + a) * step,
                            float((i / kSide) * kSteps + b) * step);
  };
  const auto angle = [](Vec3f p, Vec3f q) {
    return 2 * std::asin(std::min(1.0, 0.5 * double(length(p - q))));
  };
  for (uint32_t i = 0; i < kStrata; ++i) {
    const Vec3f axis = at(i, kSteps / 2, kSteps / 2);
    // What is farthest from the axis lies on the border of the stratum.
    double widest = 0, step = 0;
    for (uint32_t a = 0; a <= kSteps; ++a)
      for (const auto& [now, before] :
           {std::pair{at(i, a, 0), at(i, a ? a - 1 : a, 0)},
            std::pair{at(i, a, kSteps), at(i, a ? a - 1 : a, kSteps)},
            std::pair{at(i, 0, a), at(i, 0, a ? a - 1 : a)},
            std::pair{at(i, kSteps, a), at(i, kSteps, a ? a - 1 : a)}}) {
        widest = std::max(widest, angle(axis, now));
        step = std::max(step, angle(now, before));
      }
    // A direction between two of these is at most as far from the nearest as they are from each
    // other.
    const double half = widest + step;
    x[i] = axis.x, y[i] = axis.y, z[i] = axis.z;
    cosine[i] = float(std::cos(half)), sine[i] = float(std::sin(half));
  }
}

}  // namespace deltalux::gather
