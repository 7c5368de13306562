// SPDX-License-Identifier: Apache-2.0
// A surface point of a chain: the direct light there, and the place, where lights are asked again.
#pragma once
#include <bit>
#include <cstdint>

#include "base/direction.h"
#include "direct/light_shape.h"
#include "scene/scene.h"

namespace deltalux::gather {

/// A surface point of a chain, with the direct light there of one randomly chosen lamp, which
/// represents all. Light from beyond a point is multiplied by the mean reflectance of its material,
/// which edits change; how the reflectance at the point compares with this mean is a vertex of its
/// own before it, a tint, unless it is the same. Lobes have tints, too.
struct Vertex {
  /// Flag in `material`: the vertex is the far end of the chain itself.
  static constexpr uint32_t kEnd = 0x80000000u;
  /// Flag in `material`: this is no point, but factors on all light from there on.
  static constexpr uint32_t kTint = 0x40000000u;
  /// Flag in `material`: the vertex is that of the next one, but for its light: caustics, which the
  /// cell there sums. `light` is the cell.
  static constexpr uint32_t kCaustic = 0x20000000u;
  /// Flag of a tint at the end: it does not apply to the light of the cell there.
  static constexpr uint32_t kLampsOnly = 0x10000000u;
  /// Flag of a tint: it is that of the point, whose material scales its difference from 1, see
  /// surfaces::Surface::contrast().
  static constexpr uint32_t kOfSurface = 0x08000000u;
  /// Bound of the product of tints, so that sums stay finite; no scene comes near it.
  static constexpr float kMaxTint = 1e6f;
  // Without initial values: a chain has room for many more vertices than it needs.
  uint32_t material;
  /// Or kNone: no lamp illuminates the point, even unshadowed.
  uint32_t light;
  /// Irradiance by the lamp for a unit of its strength, divided by the chance of having chosen it;
  /// of caustics: 1. Zero if and only if it gets nothing.
  float direct;
  /// Of the chain up to this vertex.
  float weight;

  /// A tint; in it, the other fields hold factors. `flags`: with a material, if it is of a surface.
  static Vertex tint(Vec3f factor, uint32_t flags = 0) {
    factor = bounded(factor);
    return {kTint | flags, std::bit_cast<uint32_t>(factor.x), factor.y, factor.z};
  }
  static Vec3f bounded(Vec3f tint) { return min(tint, Vec3f{kMaxTint, kMaxTint, kMaxTint}); }
  Vec3f factor() const { return {std::bit_cast<float>(light), direct, weight}; }

  bool is_of_end() const { return material & kEnd; }
  bool is_tint() const { return material & kTint; }
  bool is_caustic() const { return material & kCaustic; }
  bool is_of_surface() const { return material & kOfSurface; }
  bool is_for_lamps_only() const { return material & kLampsOnly; }
  /// Whether the chain goes on from here by reflection.
  bool is_point() const { return !(material & (kEnd | kTint | kCaustic)); }
  uint32_t material_index() const { return material & (kOfSurface - 1); }
  /// The lamp that it asked; kNone: none.
  uint32_t lamp() const { return material & (kTint | kCaustic) ? scene::kNone : light; }
  friend bool operator==(const Vertex&, const Vertex&) = default;
};

/// Where a vertex lies, and how it faces, in 20 bytes: lamps are asked from here.
struct Place {
  // Without initial values, as those of a vertex.
  float x, y, z;
  uint32_t normal;  ///< see decode_direction()
  float plane;      ///< Receiver::plane
  static Place of(const direct::Receiver& at) {
    return {at.point.x, at.point.y, at.point.z, encode_direction(at.normal), at.plane};
  }
  Vec3f point() const { return {x, y, z}; }
  /// Random keys and the object do not matter to a single shadow ray.
  direct::Receiver receiver() const {
    return {point(), decode_direction(normal), scene::kNone, plane};
  }
};

}  // namespace deltalux::gather
