// SPDX-License-Identifier: Apache-2.0
// Averages variances over a window of neighbouring samples.
#include "gather/hits/pool_errors.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>
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

/// What samples of one surface share, as of a ceiling: the main direction of their normals, and the
/// slab of space across it. Undersides of tables see other places.
std::pair<int, float> surface_of(const Estimate& sample, float slab) {
  const int axis = main_axis(sample.normal);
  return {2 * axis + (sample.normal[axis] < 0),
          slab > 0 ? std::floor(sample.point[axis] / slab) : 0.0f};
}

/// Raises errors to what lucky rays cause among all samples of a surface: a place that is hit by
/// one ray in some thousands is missed by all rays of a neighbourhood.
void allow_for_luck(std::span<Estimate> samples, float slab) {
  struct Sum {
    double all = 0, most = 0;
    /// The most is left out: it may be that of a niche.
    double rest() const { return all - most; }
    void add(double value) { all += value, most = std::max(most, value); }
  };
  struct Surface {
    Sum absolute, relative;
    double count = 0;
  };
  std::map<std::pair<int, float>, std::array<Surface, 3>> surfaces;
  for (const Estimate& own : samples) {
    std::array<Surface, 3>& surface = surfaces[surface_of(own, slab)];
    for (size_t c = 0; c < 3; ++c) {
      const double irradiance = own.light.irradiance[c];
      if (!(irradiance > 0)) continue;
      const double of_one_ray = own.light.lucky[c] * own.rays;
      surface[c].absolute.add(of_one_ray);
      surface[c].relative.add(of_one_ray / (irradiance * irradiance));
      surface[c].count += 1;
    }
  }
  for (Estimate& own : samples) {
    const std::array<Surface, 3>& surface = surfaces[surface_of(own, slab)];
    SampleLight& light = own.light;
    for (size_t c = 0; c < 3; ++c) {
      light.lucky[c] = 0;
      if (!(light.irradiance[c] > 0)) continue;
      const double both = surface[c].absolute.rest() * surface[c].relative.rest();
      light.lucky[c] =
          light.irradiance[c] * std::sqrt(std::max(0.0, both)) / (surface[c].count * own.rays);
      light.error[c] = std::max(light.error[c], std::sqrt(light.lucky[c]));
    }
  }
}

}  // namespace

void pool_errors(std::span<Estimate> samples, double metre) {
  const auto reach = float(kReach * metre);
  std::vector<std::array<double, 3>> pooled(samples.size());
  for (size_t i = 0; i < samples.size(); ++i) {
    const Estimate& own = samples[i];
    const size_t first = i - std::min(i, kWindow), last = std::min(samples.size(), i + kWindow + 1);
    for (size_t c = 0; c < 3; ++c) {
      pooled[i][c] = own.light.error[c];
      if (!(own.light.irradiance[c] > 0)) continue;
      // The variance of one ray is about the same for all neighbours; so is the variance relative
      // to the irradiance. Where light varies strongly, one of the two assumptions overestimates
      // the error of darker samples, the other that of brighter ones; use the geometric mean.
      double absolute = 0, relative = 0, count = 0;
      for (size_t k = first; k < last; ++k) {
        const Estimate& other = samples[k];
        if (!are_comparable(own.light.irradiance[c], other.light.irradiance[c]) ||
            !are_neighbours(own, other, reach))
          continue;
        const double variance = other.light.error[c] * other.light.error[c] * other.rays / own.rays;
        absolute += variance;
        relative += variance / (other.light.irradiance[c] * other.light.irradiance[c]);
        count += 1;
      }
      const double squared = own.light.irradiance[c] * own.light.irradiance[c];
      pooled[i][c] = std::sqrt(std::sqrt(absolute * relative * squared) / count);
    }
  }
  for (size_t i = 0; i < samples.size(); ++i)
    std::copy(pooled[i].begin(), pooled[i].end(), samples[i].light.error);
  allow_for_luck(samples, reach);
}

}  // namespace deltalux::gather
