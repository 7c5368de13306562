// SPDX-License-Identifier: Apache-2.0
// How a path leaves the surface that it hit.
#pragma once
#include <algorithm>
#include <cmath>

#include "base/end_slack.h"
#include "base/hemisphere.h"
#include "base/vec.h"
#include "trace/ray_caster.h"

namespace deltalux::trace {

/// The unit normal on the side that a ray along w came from.
inline Vec3f facing_normal(const Hit& hit, Vec3f w) { return facing(hit.normal, w); }

/// How far above a surface a path leaves it, so that rounding does not put it below (as in pbrt).
/// `plane`: Scene::slack_of() of the surface.
inline float surface_slack(Vec3f origin, Vec3f w, const Hit& hit, float plane) {
  return end_slack(origin + w * hit.t, w * hit.t) + plane;
}

/// The point where a path leaves the surface that it hit, surface_slack() above it. Moves back
/// along the incoming segment, which is known to be free. Only if that does not suffice (grazing or
/// very short segments), moves along the normal, which in an acute corner could lead through the
/// other wall.
inline Vec3f leave_surface(Vec3f origin, Vec3f w, const Hit& hit, Vec3f n, float plane) {
  const float epsilon = surface_slack(origin, w, hit, plane);
  const float cosine = -dot(n, w);
  const float back = std::min(epsilon / std::max(cosine, 1.0f / 16), 0.5f * hit.t);
  return origin + w * (hit.t - back) + n * (epsilon - back * cosine);
}

/// How far behind the surface that it hit a path goes on straight: surface_slack() off it.
inline float passing_distance(Vec3f origin, Vec3f w, const Hit& hit, float plane) {
  const float cosine = std::fabs(dot(normalize(hit.normal), w));
  return surface_slack(origin, w, hit, plane) / std::max(cosine, 1.0f / 16);
}

/// The point where it goes on.
inline Vec3f pass_surface(Vec3f origin, Vec3f w, const Hit& hit, float plane) {
  return origin + w * (hit.t + passing_distance(origin, w, hit, plane));
}

}  // namespace deltalux::trace
