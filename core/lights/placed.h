// SPDX-License-Identifier: Apache-2.0
// Base of kinds of lights that shine from a point: each kind defines only the distribution over
// directions.
#pragma once
#include "lights/kind.h"

namespace deltalux::lights {

class Placed : public Kind {
 public:
  bool is_parallel() const final { return false; }
  void place(Punctual&, const Pose&, const Box&) const override {}
  double max_extent(const Punctual& light, const Box&) const final { return extent(light); }
  Start start(const Punctual& light, const std::array<float, 4>& random) const final;
  double irradiance(const Punctual& light, Vec3f point, Vec3f normal, float slack) const final;
  ShadowRay shadow_ray(const Punctual& light, Vec3f origin) const final;

 private:
  /// The intensity in direction `d` (of any length), relative to the maximum, in [0, 1]; extent()
  /// is the integral over all directions.
  virtual double falloff(const Punctual& light, Vec3f d) const = 0;
  /// Draws a direction in proportion to that. `u`, `v`: random, in [0, 1).
  virtual Vec3f draw(const Punctual& light, float u, float v) const = 0;
};

}  // namespace deltalux::lights
