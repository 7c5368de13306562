// SPDX-License-Identifier: Apache-2.0
// Suns whose light is asked for where a ray lands, never averaged over a cell: of a sill that is
// half in the sun a room may see the other half.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "trace/lights.h"

namespace deltalux::gather {

/// Of the suns by number that the bake chose, those that shine now.
class Suns {
 public:
  /// The largest share of rays that meet what a sun lights, for it to be asked for: outdoors cells
  /// tell as much, and cost less.
  static constexpr double kMaxLit = 0.2;

  Suns() = default;
  Suns(std::span<const uint32_t> chosen, std::span<const trace::Light> lights);
  /// Why such a choice can't be; null where it can.
  static const char* flaw(std::span<const uint32_t> chosen, std::span<const trace::Light> lights);

  bool has(uint32_t light) const { return light < shines_.size() && shines_[light]; }
  /// Whether one shines on surfaces with that normal, where nothing is between.
  bool may_shine(Vec3f normal) const {
    for (const Vec3f direction : directions_)
      if (dot(normal, direction) < 0) return true;
    return false;
  }
  /// Those that shine, ascending.
  std::span<const uint32_t> lights() const { return lights_; }
  friend bool operator==(const Suns&, const Suns&) = default;

 private:
  std::vector<uint8_t> shines_;  // per light, up to the last
  std::vector<uint32_t> lights_;
  std::vector<Vec3f> directions_;  // of these
};

}  // namespace deltalux::gather
