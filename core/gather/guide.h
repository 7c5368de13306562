// SPDX-License-Identifier: Apache-2.0
// A small bright place, as the pool of a spot or of the sun, and the directions towards it.
#pragma once
#include <array>
#include <cmath>
#include <numbers>

#include "base/vec.h"

namespace deltalux::gather {

/// A square around a bright place, which evenly spread rays find too often or never: rays towards
/// it are drawn more often, and weigh less. All light is the sum of the channels.
struct Guide {
  static constexpr size_t kSide = 32;  ///< its texels

  Vec3f centre, normal;
  float half;       ///< of its side
  float rise;       ///< how far from its plane what is bright may lie
  float radiosity;  ///< mean
  float brightest;  ///< root mean square: of what a ray that meets it by chance brings
  float around;     ///< irradiance of those samples that see it
  /// Chances: of a row below the given one, and of a column below it within each row.
  std::array<float, kSide + 1> row;
  std::array<std::array<float, kSide + 1>, kSide> column;

  /// Directions of the rows' and the columns' axis follow from the normal.
  Vec3f point(float u, float v) const;
  /// Why rays can't follow it; null where they can.
  const char* flaw() const;
};

/// A guide as a place sees it: directions towards its points.
class Target {
 public:
  Target() = default;
  /// Refers to the guide.
  Target(const Guide& guide, Vec3f from);
  Target(const Guide&&, Vec3f) = delete;
  /// Towards texels by their chances. `u`, `v`: random, in [0, 1).
  Vec3f direction(float u, float v) const;
  /// Chance per solid angle of direction(), times pi.
  float density(Vec3f w) const;
  /// False only where no direction of it meets the ball.
  bool may_meet(Vec3f to_centre, float radius) const;

 private:
  const Guide* guide_ = nullptr;
  Vec3f to_centre_{};
};

inline constexpr uint32_t kMostGuides = 64;

inline bool is_unit(Vec3f v) { return std::fabs(dot(v, v) - 1) < 1e-3f; }

/// What a guide is of a receiver's view, cosine included, unshadowed: times radiosity, the
/// irradiance that it brings. 0 where one is behind the other.
inline float share_of_view(Vec3f centre, Vec3f normal, float half, Vec3f from, Vec3f n) {
  constexpr float kGrazing = 0.01f;  // cosine: what is seen more aslant is left out
  const Vec3f d = centre - from;
  const float squared = dot(d, d), distance = std::sqrt(squared);
  const float over = dot(n, d) + half, above = over < distance ? over : distance;
  const float front = -dot(normal, d);
  const float area = 4 * half * half / std::numbers::pi_v<float>;
  const float share = above * front * area / (squared * squared);
  const float view = share < 1.0f ? share : 1.0f;
  return (above > 0) & (front > kGrazing * distance) ? view : 0.0f;
}
inline float share_of_view(const Guide& guide, Vec3f from, Vec3f n) {
  return share_of_view(guide.centre, guide.normal, guide.half, from, n);
}

}  // namespace deltalux::gather
