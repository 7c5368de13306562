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

inline constexpr uint32_t kMaxGuides = 64;

/// Squares of guides, column by column: one by one they lie too far apart in memory.
template <size_t N>
struct GuideSquares {
  static_assert(N % 8 == 0);                       // whole vectors
  alignas(64) std::array<float, N> x{}, y{}, z{};  ///< centre
  alignas(64) std::array<float, N> normal_x{}, normal_y{}, normal_z{}, half{};

  void set(size_t i, const Guide& guide) {
    x[i] = guide.centre.x, y[i] = guide.centre.y, z[i] = guide.centre.z;
    normal_x[i] = guide.normal.x, normal_y[i] = guide.normal.y, normal_z[i] = guide.normal.z;
    half[i] = guide.half;
  }
  /// 0 for those of the first `count` that Target::density() is 0 of, but for few.
  void may_meet(Vec3f from, Vec3f w, size_t count, std::array<float, N>& may) const {
    constexpr float kCorner = 2.02f;  // squared, of the half side; Target's, and some rounding
    for (size_t i = 0; i < count; ++i) {
      const Vec3f c{x[i] - from.x, y[i] - from.y, z[i] - from.z};
      const Vec3f n{normal_x[i], normal_y[i], normal_z[i]};
      const float along = dot(w, n), away = dot(c, n);
      const Vec3f off = w * away - c * along;
      const float reach = half[i] * along;
      may[i] = (away * along >= 0) & (dot(off, off) <= kCorner * reach * reach) ? 1.0f : 0.0f;
    }
  }
};

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
