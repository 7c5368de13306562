// SPDX-License-Identifier: Apache-2.0
// Chooses integer units of direct light by what lights give at typical and at short distances.
#include "direct/scales.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace deltalux::direct {
namespace {

double strongest(const Vec3d& v) { return std::max({v.x, v.y, v.z}); }

/// The finest quantum for this light: a tiny share of what it could give at a distance of one
/// metre of the scene. A spot counts as if it shone in all directions: the power of a narrow spot
/// says little about the intensity of its beam.
double finest_quantum(const trace::Light& light, double metre) {
  // 40 bits for that, and fewer where a light much smaller than the metre gives more nearby: as
  // much as there is on its surface, or what a point gives at 1/29,000 of the metre.
  constexpr double kFine = 0x1p-40, kNearby = 0x1p26;
  const double area = metre * metre;
  const Vec3d strength(light.strength);
  double given = 0, nearby = 0;
  if (light.is_parallel()) {
    given = nearby = strongest(strength);
  } else if (light.area > 0) {
    // No place gets more than where the light fills the hemisphere.
    const double most = strongest(strength) * double(light.brightest_part) * std::numbers::pi;
    given = std::min(strongest(light.power) / area, most);
    nearby = std::min(strongest(light.power) * (4 / area) * kNearby, most);
  } else {
    given = strongest(strength) * (4 * std::numbers::pi / area);
    nearby = given * kNearby;
  }
  return std::max(given * kFine, nearby / kMaxWeight);
}

}  // namespace

Scales choose_scales(std::span<const trace::Light> lights, double metre) {
  double quantum = 0;
  for (const trace::Light& light : lights)
    quantum = std::max(quantum, finest_quantum(light, metre));
  return {quantum > 0 ? quantum : 1.0, 0, metre};
}

double quantum_of(const trace::Light& light, const Scales& scales) {
  constexpr double kStep = 8;  // in bits, so that similar lights share their sums
  const double finest = finest_quantum(light, scales.metre);
  if (!(finest > 0)) return scales.quantum;
  constexpr double kSlack = 1e-9;  // rounding of the logarithm
  const double steps = std::floor(std::log2(scales.quantum / finest) / kStep + kSlack);
  return std::ldexp(scales.quantum, -int(kStep * steps));
}

}  // namespace deltalux::direct
