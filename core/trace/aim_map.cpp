// SPDX-License-Identifier: Apache-2.0
// Draws pairs of a light's parts and targets, and tells how densely their paths lie.
#include "trace/aim_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace deltalux::trace {
namespace {

constexpr double kClose = 1.02;  // radii of a ball: from within, it is not aimed at

}  // namespace

AimMap::Choice AimMap::choose(float r) const {
  const auto above = std::upper_bound(below.begin() + 1, below.end(), r);
  const size_t pair = size_t(above - below.begin()) - 1;
  // A place at the end of a part stays within it, whatever is rounded.
  const float within = std::clamp((r - below[pair]) / chance(pair), 0.0f, 1 - 0x1p-16f);
  return {(float(pair / targets.size()) + within) / float(kParts), uint32_t(pair % targets.size())};
}

double AimMap::versine_of(const Target& target, Vec3f from) {
  const Vec3d d(target.centre - from);
  const double squared = dot(d, d), radius = double(target.radius);
  if (!(squared > kClose * kClose * radius * radius)) return kInside;
  const double sine_squared = radius * radius / squared;
  return sine_squared / (1 + std::sqrt(1 - sine_squared));
}

double AimMap::density(float place, Vec3f from, Vec3f w, const Target* own,
                       double cosine_density) const {
  const size_t first = size_t(place * float(kParts)) * targets.size();
  double sum = 0;
  for (size_t k = 0; k < targets.size(); ++k) {
    const double share = double(chance(first + k)) * kParts;
    if (!(share > 0)) continue;
    const Target& target = targets[k];
    const double versine = versine_of(target, from);
    if (versine == kInside) {
      sum += share * cosine_density;
      continue;
    }
    const Vec3d d(target.centre - from), along(w), aside = cross(d, along);
    const double radius = double(target.radius);
    if (&target == own || (dot(d, along) > 0 && dot(aside, aside) <= radius * radius))
      sum += share / (2 * std::numbers::pi * versine);
  }
  return sum;
}

const char* AimMap::flaw() const {
  if (targets.empty() || targets.size() > kMostTargets)
    return "a number of targets that no map has";
  if (below.size() != kParts * targets.size()) return "chances of other parts and targets";
  for (const Target& target : targets) {
    for (int axis = 0; axis < 3; ++axis)
      if (!(std::fabs(target.centre[axis]) <= kFarthest)) return "a target that is not finite";
    if (!(target.radius > 0 && target.radius <= kFarthest)) return "a target without size";
  }
  if (below.front() != 0) return "chances that do not grow from 0 to 1";
  for (size_t i = 0; i < below.size(); ++i)
    if (!(below[i] >= 0 && below[i] < 1) || !(chance(i) >= 0))
      return "chances that do not grow from 0 to 1";
  return nullptr;
}

}  // namespace deltalux::trace
