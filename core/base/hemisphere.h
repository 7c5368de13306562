// SPDX-License-Identifier: Apache-2.0
// Directions on one side of a surface.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/vec.h"

namespace deltalux {

/// The unit vector along `normal` (not normalised) on the side that a ray along w comes from.
inline Vec3f facing(Vec3f normal, Vec3f w) {
  const Vec3f n = normalize(normal);
  return dot(n, w) > 0 ? -n : n;
}

/// The direction of a ray along w after a mirror; n: its unit normal.
inline Vec3f mirrored(Vec3f w, Vec3f n) { return normalize(w - n * (2 * dot(n, w))); }

/// The unit vector at a share of a full turn from `u` towards `v`, two perpendicular unit vectors.
inline Vec3f on_circle(Vec3f u, Vec3f v, float share) {
  const float turn = 2 * std::numbers::pi_v<float> * share;
  return u * std::cos(turn) + v * std::sin(turn);
}

/// Cosine-distributed direction about the unit vector n (concentric map, Shirley & Chiu 1997).
inline Vec3f cosine_direction(Vec3f n, float r, float s) {
  const float a = 2 * r - 1, b = 2 * s - 1;
  float radius = 0, phi = 0;
  if (a * a > b * b) {
    radius = a;
    phi = (std::numbers::pi_v<float> / 4) * (b / a);
  } else if (b != 0) {
    radius = b;
    phi = (std::numbers::pi_v<float> / 2) - (std::numbers::pi_v<float> / 4) * (a / b);
  }
  const float x = radius * std::cos(phi), y = radius * std::sin(phi);
  return turned({x, y, std::sqrt(std::max(0.0f, 1 - x * x - y * y))}, n);
}

}  // namespace deltalux
