// SPDX-License-Identifier: Apache-2.0
// Averages variances over a window of neighbouring samples.
#include "gather/pool_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

namespace deltalux::gather {
namespace {

constexpr size_t kWindow = 16;  // samples before and after
constexpr float kAlike = 0.7f;  // cosine: normals of neighbours differ by less
constexpr double kReach = 0.5;  // scene metres
// Neighbours that differ more, by this factor, are across an edge of light: nothing is learned of
// one from the other.
constexpr double kMaxContrast = 30;

bool are_neighbours(const Estimate& a, const Estimate& b, float reach) {
  const Vec3f d = a.point - b.point;
  return a.object == b.object && dot(d, d) <= reach * reach && dot(a.normal, b.normal) >= kAlike;
}

/// Whether two irradiances, of which `a` is positive, are of comparable size.
bool are_comparable(double a, double b) {
  return b > 0 && a <= kMaxContrast * b && b <= kMaxContrast * a;
}

}  // namespace

void pool_errors(std::span<Estimate> samples, double metre) {
  const auto reach = float(kReach * metre);
  std::vector<std::array<double, 3>> pooled(samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    const Estimate& own = samples[i];
    const size_t first = i - std::min(i, kWindow), last = std::min(samples.size(), i + kWindow + 1);
    for (size_t c = 0; c < 3; ++c) {
      pooled[i][c] = own.error[c];
      if (!(own.irradiance[c] > 0)) continue;
      // The variance of one ray is about the same for all neighbours; so is the variance relative
      // to the irradiance. Where light varies strongly, one of the two assumptions overestimates
      // the error of darker samples, the other that of brighter ones; use the geometric mean.
      double absolute = 0, relative = 0, count = 0;
      for (size_t k = first; k < last; ++k) {
        const Estimate& other = samples[k];
        if (!are_comparable(own.irradiance[c], other.irradiance[c]) ||
            !are_neighbours(own, other, reach))
          continue;
        const double variance = other.error[c] * other.error[c] * other.rays / own.rays;
        absolute += variance;
        relative += variance / (other.irradiance[c] * other.irradiance[c]);
        count += 1;
      }
      const double squared = own.irradiance[c] * own.irradiance[c];
      pooled[i][c] = std::sqrt(std::sqrt(absolute * relative * squared) / count);
    }
  }
  for (size_t i = 0; i < samples.size(); ++i)
    std::copy(pooled[i].begin(), pooled[i].end(), samples[i].error);
}

}  // namespace deltalux::gather
