// SPDX-License-Identifier: Apache-2.0
// Points that rays aim for, as seen from a place.
#include "gather/aim/target.h"

namespace deltalux::gather {
namespace {

// relative to the distance: hits that are closer together count as the same
constexpr float kSame = 1e-4f;

}  // namespace

Vec3f AimPoint::seen_from(Vec3f origin) const {
  const Vec3f d = at - origin;
  if (!valid() || !(dot(normal, d) < 0)) return {};
  return normalize(d);
}

bool AimPoint::is_met(Vec3f origin, Vec3f w, const trace::Hit& hit) const {
  if (hit.primitive == primitive) return true;
  const Vec3f off = origin + w * hit.t - at;
  return dot(off, off) <= kSame * kSame * hit.t * hit.t;
}

}  // namespace deltalux::gather
