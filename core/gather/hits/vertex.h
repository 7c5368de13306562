// SPDX-License-Identifier: Apache-2.0
// A surface point of a chain, with the direct light there.
#pragma once
#include <array>
#include <cstdint>

#include "scene/scene.h"

namespace deltalux::gather {

/// A surface point of a chain, with the direct light there of one randomly chosen light, which
/// represents all lights. Light from beyond a point is multiplied by the mean reflectance of its
/// material, which edits change; how the reflectance at the points compares with these means is a
/// vertex of its own behind all of them, unless it is the same.
struct Vertex {
  /// Flag in `material`: the vertex is the far end of the chain itself.
  static constexpr uint32_t kEnd = 0x80000000u;
  /// Flag in `material`: the vertex is that of the next one, but for its light: caustics, which the
  /// cell there sums. `light` is the cell, `direct` the factors on its irradiance by them.
  static constexpr uint32_t kCaustic = 0x20000000u;
  /// Value of `material`: this is no point; `direct` holds factors on light from beyond.
  static constexpr uint32_t kTint = 0x40000000u;
  /// Bound of such factors, so that sums stay finite; no scene comes near it.
  static constexpr float kMaxTint = 1e6f;
  // Without initial values: a chain has room for many more vertices than it needs.
  uint32_t material;
  /// Or kNone: no light illuminates the point, even unshadowed.
  uint32_t light;
  /// Irradiance without dimming, times the weight of the chain up to this vertex, times
  /// Scene::tint_at() of this vertex and (not for those of the end) of all before it.
  std::array<float, 3> direct;
  bool is_of_end() const { return material & kEnd; }
  bool is_tint() const { return material == kTint; }
  bool is_caustic() const { return material & kCaustic; }
  uint32_t material_index() const { return material & ~(kEnd | kCaustic); }
  /// The lamp that it asked; kNone: none.
  uint32_t lamp() const { return is_caustic() ? scene::kNone : light; }
  friend bool operator==(const Vertex&, const Vertex&) = default;
};

}  // namespace deltalux::gather
