// SPDX-License-Identifier: Apache-2.0
// Suns whose direct light gather rays compute by shadow rays, instead of averaging it over cells:
// of a sill that is half in the sun, a room may see only the other half.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "trace/lights.h"

namespace deltalux::gather {

/// Those of the suns chosen at the bake that shine at present.
class Suns {
 public:
  /// The largest share of rays that may hit what a sun lights: beyond, as outdoors, cells are as
  /// accurate and cost less.
  static constexpr double kMaxLit = 0.2;

  Suns() = default;
  Suns(std::span<const uint32_t> chosen, std::span<const trace::Light> lights);
  /// Why such a choice is invalid; null if it is valid.
  static const char* flaw(std::span<const uint32_t> chosen, std::span<const trace::Light> lights);

  bool has(uint32_t light) const { return light < shines_.size() && shines_[light]; }
  /// Whether a sun shines on surfaces with that normal, if nothing is in between.
  bool may_shine(Vec3f normal) const {
    for (const Vec3f direction : directions_)
      if (dot(normal, direction) < 0) return true;
    return false;
  }
  /// Indices of the suns that shine, ascending.
  std::span<const uint32_t> lights() const { return lights_; }
  friend bool operator==(const Suns&, const Suns&) = default;

 private:
  std::vector<uint8_t> shines_;  // by light, up to the last sun
  std::vector<uint32_t> lights_;
  std::vector<Vec3f> directions_;  // of the lights in lights_
};

}  // namespace deltalux::gather
