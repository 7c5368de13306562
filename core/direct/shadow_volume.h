// SPDX-License-Identifier: Apache-2.0
// Where an object can throw its shadow: the points from which it may hide a part of a light.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>

#include "base/vec.h"
#include "trace/lights.h"

namespace deltalux::direct {

/// The points p for which the convex hull of p and the light's box meets the blocker's box, that is
/// blocker + cone(blocker - light): a convex polyhedron each of whose faces contains the direction
/// of an axis, so at most nine planes describe it exactly.
class ShadowVolume {
 public:
  /// `slack` (metres) widens the volume against rounding. An empty blocker hides nothing.
  ShadowVolume(const trace::Light& light, const Box& blocker, float slack);

  bool contains(Vec3f p) const {
    for (size_t i = 0; i < count_; ++i)
      if (!(planes_[i].height(p.x, p.y, p.z) <= planes_[i].limit)) return false;
    return !nothing_;
  }
  /// True when the volume holds no point of `points`. Never true when contains() holds for one of
  /// them: rounding is monotonic.
  bool misses(const Box& points) const;
  /// marks[i] |= contains(point i) ? 1 : 0, the same bits as contains().
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

}  // namespace deltalux::direct
