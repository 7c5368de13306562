// SPDX-License-Identifier: Apache-2.0
// What all kinds of lights have in common.
#include "lights/kind.h"

#include "base/cone.h"

namespace deltalux::lights {

bool Kind::may_reach(const Punctual& light, Vec3f centre, float radius) const {
  const float cosine = 1 - cone(light);
  if (!(cosine >= 0)) return true;  // wider than a hemisphere, or parallel
  const Cone all{light.direction, cosine, sine_of(cosine)};
  return all.may_meet(centre - light.position, radius);
}

bool Kind::may_reach(const Punctual& light, const Box& box) const {
  return !box.empty() && may_reach(light, box.centre(), 0.5001f * box.diagonal());
}

}  // namespace deltalux::lights
