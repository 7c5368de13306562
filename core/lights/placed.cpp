// SPDX-License-Identifier: Apache-2.0
// Paths and shadow rays of lights that shine from a point.
#include "lights/placed.h"

#include <algorithm>
#include <cmath>

#include "base/end_slack.h"

namespace deltalux::lights {

Start Placed::start(const Punctual& light, const std::array<float, 4>& random) const {
  return {light.position, draw(light, random[0], random[1])};
}

double Placed::irradiance(const Punctual& light, Vec3f point, Vec3f normal, float slack) const {
  const Vec3f d = light.position - point;
  const float cosine = dot(normal, d);
  if (!(cosine > 0)) return 0;
  // Within the distance that shadow rays cannot resolve, the irradiance does not increase further.
  const double nearest = std::max(double(position_slack(light.position) + slack), 1e-18);
  const double squared = std::max(double(dot(d, d)), nearest * nearest);
  const double distance = std::sqrt(squared);
  return falloff(light, -d) * cosine / (squared * distance);
}

ShadowRay Placed::shadow_ray(const Punctual& light, Vec3f origin) const {
  const Vec3f d = light.position - origin;
  // Stop short of the light, which may lie on a surface.
  const float short_of = 2 * end_slack(light.position, d), distance = length(d);
  return {d, distance > short_of ? 1 - short_of / distance : 0.0f};
}

}  // namespace deltalux::lights
