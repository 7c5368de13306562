// SPDX-License-Identifier: Apache-2.0
// Irradiance from a triangle of unit radiance in closed form (Lambert 1760; Arvo 1994 for the
// clipped polygon).
#pragma once
#include <cmath>

#include "base/vec.h"

namespace deltalux::direct {

/// `v`: the corners relative to the receiver; `normal`: unit normal of the receiver. Clips the
/// triangle to the receiver's horizon; counts both sides of the triangle.
inline double triangle_irradiance(const Vec3d v[3], Vec3d normal) {
  Vec3d clipped[4];
  int count = 0;
  for (int k = 0; k < 3; ++k) {
    const Vec3d a = v[k], b = v[k == 2 ? 0 : k + 1];
    const double above_a = dot(normal, a), above_b = dot(normal, b);
    if (above_a > 0) clipped[count++] = a;
    if ((above_a > 0) != (above_b > 0))
      clipped[count++] = a + (b - a) * (above_a / (above_a - above_b));
  }
  double sum = 0;
  for (int k = 0; k < count; ++k) {
    const Vec3d a = clipped[k], b = clipped[k + 1 == count ? 0 : k + 1];
    const Vec3d across = cross(a, b);
    const double sine = length(across);
    if (sine > 0) sum += std::atan2(sine, dot(a, b)) * dot(normal, across) / sine;
  }
  return 0.5 * std::fabs(sum);
}

}  // namespace deltalux::direct
