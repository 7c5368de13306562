// SPDX-License-Identifier: Apache-2.0
// How a walk leaves the surface that it hit.
#pragma once
#include <algorithm>

#include "base/vec.h"
#include "trace/ray_caster.h"

namespace deltalux::trace {

/// The unit normal on the side that a ray along w came from.
inline Vec3f facing_normal(const Hit& hit, Vec3f w) {
  const Vec3f n = normalize(hit.normal);
  return dot(n, w) > 0 ? -n : n;
}

/// Where a path leaves the surface that it hit, `epsilon` above it: back along the flight, which
/// crossed nothing, and only what that cannot give (grazing or very short flights) along the
/// normal, which in an acute corner would lead through the other wall.
inline Vec3f leave_surface(Vec3f origin, Vec3f w, const Hit& hit, Vec3f n, float epsilon) {
  const float cosine = -dot(n, w);
  const float back = std::min(epsilon / std::max(cosine, 1.0f / 16), 0.5f * hit.t);
  return origin + w * (hit.t - back) + n * (epsilon - back * cosine);
}

}  // namespace deltalux::trace
