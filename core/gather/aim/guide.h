// SPDX-License-Identifier: Apache-2.0
// Guides: small bright places, such as a pool of light from a spot or the sun, and directions
// towards them.
#pragma once
#include <array>
#include <cmath>
#include <numbers>

#include "base/vec.h"
#include "gather/aim/target.h"

namespace deltalux::gather {

/// A square around a bright place, which cosine-distributed rays would hit too often or never. More
/// rays are sent towards it, with a smaller weight each. All light is the sum of the channels.
struct Guide {
  static constexpr size_t kSide = 32;  ///< texels along each side

  Vec3f centre, normal;
  float half;       ///< half of the side's length
  float rise;       ///< how far bright surfaces may lie from its plane
  float radiosity;  ///< mean
  float brightest;  ///< root mean square: what a ray that hits the guide by chance brings
  float around;     ///< median irradiance of the places that see it
  /// Cumulative probabilities of the rows, and of the columns within each row.
  std::array<float, kSide + 1> row;
  std::array<std::array<float, kSide + 1>, kSide> column;

  using Texels = std::array<std::array<float, kSide>, kSide>;
  /// Sets the probabilities and the brightness by the radiosity seen at each texel. `known`: from
  /// many points of it. Otherwise its neighbours may be as bright.
  void set_texels(const Texels& radiosity_at, bool known = false);

  /// The point at (u, v) in [0, 1]²; its axes follow from the normal.
  Vec3f point(float u, float v) const;
  /// Whether a place is in front of the square or behind it, no farther than its rise.
  bool holds(Vec3f place) const;
  /// Why these data are invalid; null if they are valid.
  const char* flaw() const;
};

/// The square of a guide.
class Square final : public Target {
 public:
  /// Keeps a reference to the guide.
  explicit Square(const Guide& guide) : guide_(&guide) {}
  explicit Square(const Guide&&) = delete;
  /// A direction towards a texel, drawn by the texels' probabilities.
  Vec3f direction(Vec3f from, float u, float v) const;
  /// The probability density of direction() per solid angle, times pi.
  float density(Vec3f from, Vec3f w) const;

  Aim aim(Vec3f from, float u, float v) const override { return {direction(from, u, v)}; }
  float density(const LandedRay& ray, bool&) const override { return density(ray.from, ray.w); }
  bool may_meet(Vec3f from, Vec3f to_ball, float radius) const override;
  Expected expected(Vec3f from, Vec3f n) const override;
  float share(Vec3f from, Vec3f n) const override;
  void look(uint32_t k, const PathRandom& random, VisibilityTest& test,
            uint32_t& seen) const override;
  const Guide* square() const override { return guide_; }

 private:
  const Guide* guide_;
};

inline constexpr uint32_t kMaxGuides = 64;

/// The squares of guides as a structure of arrays; the guides themselves are too far apart in
/// memory.
template <size_t N>
struct GuideSquares {
  static_assert(N % 8 == 0);                       // whole SIMD vectors
  alignas(64) std::array<float, N> x{}, y{}, z{};  ///< centre
  alignas(64) std::array<float, N> normal_x{}, normal_y{}, normal_z{}, half{};

  void set(size_t i, const Guide& guide) {
    x[i] = guide.centre.x, y[i] = guide.centre.y, z[i] = guide.centre.z;
    normal_x[i] = guide.normal.x, normal_y[i] = guide.normal.y, normal_z[i] = guide.normal.z;
    half[i] = guide.half;
  }
  /// For each of the first `count` guides: 0 only if Square::density() is 0; 1 for the others and
  /// for a few more.
  template <size_t M>
  void may_meet(Vec3f from, Vec3f w, size_t count, std::array<float, M>& may) const {
    static_assert(M >= N);
    // squared, in units of the half side; Square's value with a margin for rounding
    constexpr float kCorner = 2.02f;
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

/// The guide's share of a receiver's cosine-weighted view, unshadowed: times radiosity, it gives
/// the irradiance that the guide brings. 0 if one of the two is behind the other.
inline float share_of_view(Vec3f centre, Vec3f normal, float half, Vec3f from, Vec3f n) {
  constexpr float kGrazing = 0.01f;  // cosine: guides seen at a more grazing angle are left out
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
