// SPDX-License-Identifier: Apache-2.0
// The shadow volume of an object: the points from which it may hide a part of a light.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::trace {

/// How much shadow volumes are widened: shadow rays start and end slightly off their surfaces.
inline float shadow_slack(const RayCaster& caster) { return 4 * caster.margin(); }

/// The points p for which the convex hull of p and the light's box intersects the blocker's box,
/// that is, blocker + cone(blocker - light): a convex polyhedron whose faces are each parallel to a
/// coordinate axis, so that at most nine planes describe it exactly. Empty if the blocker lies
/// outside of the light's cone.
class ShadowVolume {
 public:
  /// `slack` (metres) widens the volume against rounding. An empty blocker has an empty volume.
  ShadowVolume(const Light& light, const Box& blocker, float slack);

  bool contains(Vec3f p) const {
    for (size_t i = 0; i < count_; ++i)
      if (!(planes_[i].height(p.x, p.y, p.z) <= planes_[i].limit)) return false;
    return !nothing_;
  }
  /// True only if the volume contains no point of the box `points`; never true if contains() holds
  /// for one of them, since rounding is monotonic.
  bool misses(const Box& points) const;
  /// A box around all points of `space` that the volume contains; empty if there are none.
  Box bounds(Box space) const;
  /// Sets marks[i] |= 1 where contains(point i), with exactly the same result.
  void mark(const float* x, const float* y, const float* z, size_t count, uint32_t* marks) const;

 private:
  struct Plane {
    float a = 0, b = 0, c = 0, limit = 0;
    float height(float x, float y, float z) const { return a * x + b * y + c * z; }
  };
  void add(Vec3d normal, const Box& blocker, float slack);

  std::array<Plane, 9> planes_;
  size_t count_ = 0;
  bool nothing_ = false;
};

}  // namespace deltalux::trace
