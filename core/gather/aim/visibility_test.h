// SPDX-License-Identifier: Apache-2.0
// Counts the lines from a place that nothing static blocks.
#pragma once
#include <array>

#include "trace/ray_caster.h"

namespace deltalux::gather {

/// Collects lines from one receiver, and casts many at once.
class VisibilityTest {
 public:
  VisibilityTest(const trace::RayCaster& caster, Vec3f from, Vec3f n)
      : caster_(caster), normal_(n) {
    fan_.origin = from;
  }
  const trace::RayCaster& caster() const { return caster_; }
  Vec3f from() const { return fan_.origin; }
  Vec3f normal() const { return normal_; }
  /// Lets cast() add 1 to `seen` if nothing static is before the point at offset `d`.
  void add(Vec3f d, uint32_t& seen) {
    if (fan_.count == trace::RayFan::kMaxRays) cast();
    fan_.x[fan_.count] = d.x, fan_.y[fan_.count] = d.y, fan_.z[fan_.count] = d.z;
    seen_[fan_.count++] = &seen;
  }
  void cast() {
    trace::RayBits all{};
    for (size_t i = 0; i < fan_.count; ++i) all[i / 64] |= uint64_t(1) << (i % 64);
    const trace::RayBits blocked = caster_.occluded_static(fan_, all);
    for (size_t i = 0; i < fan_.count; ++i) *seen_[i] += !(blocked[i / 64] >> (i % 64) & 1);
    fan_.count = 0;
  }

 private:
  const trace::RayCaster& caster_;
  Vec3f normal_;
  trace::RayFan fan_;
  std::array<uint32_t*, trace::RayFan::kMaxRays> seen_;
};

}  // namespace deltalux::gather
