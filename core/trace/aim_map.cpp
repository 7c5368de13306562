// SPDX-License-Identifier: Apache-2.0
// Draws pairs of a light's parts and targets, and tells how densely their paths lie.
#include "trace/aim_map.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace deltalux::trace {
namespace {

constexpr float kClose = 1.02f;  // radii of a ball: from within, it is not aimed at
constexpr float kInside = -2;

}  // namespace

AimMap::Choice AimMap::choose(float r) const {
  const auto above = std::upper_bound(below.begin() + 1, below.end(), r);
  const size_t pair = size_t(above - below.begin()) - 1;
  // A place at the end of a part stays within it, whatever is rounded.
  const float within = std::clamp((r - below[pair]) / chance(pair), 0.0f, 1 - 0x1p-16f);
  return {(float(pair / targets.size()) + within) / float(kParts), uint32_t(pair % targets.size())};
}

float AimMap::cosine_of(const Target& target, Vec3f from) {
  const Vec3f d = target.centre - from;
  const float squared = dot(d, d), radius = target.radius;
  if (!(squared > kClose * kClose * radius * radius)) return kInside;
  return std::sqrt(1 - radius * radius / squared);
}

double AimMap::density(float place, Vec3f from, Vec3f w, double cosine_density) const {
  const size_t first = size_t(place * float(kParts)) * targets.size();
  double sum = 0;
  for (size_t k = 0; k < targets.size(); ++k) {
    const double share = double(chance(first + k)) * kParts;
    if (!(share > 0)) continue;
    const float cosine = cosine_of(targets[k], from);
    if (cosine == kInside) {
      sum += share * cosine_density;
      continue;
    }
    const Vec3f d = targets[k].centre - from;
    if (dot(d, w) >= cosine * length(d)) sum += share / (2 * std::numbers::pi * double(1 - cosine));
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
