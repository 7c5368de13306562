// SPDX-License-Identifier: Apache-2.0
// A surface point of a chain: the direct light there, and the place, where lights are asked again.
#pragma once
#include <bit>
#include <cstdint>
#include <span>

#include "base/direction.h"
#include "direct/light_shape.h"
#include "gather/hits/tint.h"
#include "scene/scene.h"

namespace deltalux::gather {

/// A surface point of a chain, with the direct light there of one randomly chosen lamp, which
/// represents all. Light from beyond a point is multiplied by the mean reflectance of its material,
/// which edits change, times the tint of the point, see Points.
struct Vertex {
  /// Flag in `material`: the vertex is the far end of the chain itself.
  static constexpr uint32_t kEnd = 0x80000000u;
  /// Flag in `material`: this is no point, but factors on all light from there on: of lobes.
  static constexpr uint32_t kFactor = 0x40000000u;
  /// Flag in `material`: the vertex is that of the next one, but for its light: caustics, which the
  /// cell there sums. `light` is the cell.
  static constexpr uint32_t kCaustic = 0x20000000u;
  /// Bound of the product of factors, so that sums stay finite; no scene comes near it.
  static constexpr float kMaxFactor = 1e6f;
  // Without initial values: a chain has room for many more vertices than it needs.
  uint32_t material;
  /// Or kNone: no lamp illuminates the point, even unshadowed.
  uint32_t light;
  /// Irradiance by the lamp for a unit of its strength, divided by the chance of having chosen it;
  /// of caustics: 1. Zero if and only if it gets nothing.
  float direct;
  /// Of the chain up to this vertex.
  float weight;

  /// Of factors; they are in the other fields.
  static Vertex of_factor(Vec3f factor) {
    factor = bounded(factor);
    return {kFactor, std::bit_cast<uint32_t>(factor.x), factor.y, factor.z};
  }
  static Vec3f bounded(Vec3f factor) {
    return min(factor, Vec3f{kMaxFactor, kMaxFactor, kMaxFactor});
  }
  Vec3f factor() const { return {std::bit_cast<float>(light), direct, weight}; }

  bool is_of_end() const { return material & kEnd; }
  bool is_factor() const { return material & kFactor; }
  bool is_caustic() const { return material & kCaustic; }
  /// Whether the chain goes on from here by reflection.
  bool is_point() const { return !(material & (kEnd | kFactor | kCaustic)); }
  uint32_t material_index() const { return material & ~(kEnd | kCaustic); }
  /// The lamp that it asked; kNone: none.
  uint32_t lamp() const { return material & (kFactor | kCaustic) ? scene::kNone : light; }
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

/// What is known of the vertices of a chain, as many of each.
struct Points {
  std::span<const Vertex> vertices;
  std::span<const Place> places;
  /// May be empty: all are 1. Those of factors are 1.
  std::span<const Tint> tints;
  size_t size() const { return vertices.size(); }
  Points subspan(size_t from, size_t count) const {
    return {vertices.subspan(from, count), places.subspan(from, count),
            tints.empty() ? tints : tints.subspan(from, count)};
  }
};

}  // namespace deltalux::gather
