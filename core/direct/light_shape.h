// SPDX-License-Identifier: Apache-2.0
// A light as its receivers see it: irradiance without anything in between, and shadow rays.
#pragma once
#include <cstdint>
#include <vector>

#include "base/vec.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// A surface point that takes light: its irradiance is asked. A zero normal takes none (its object
/// is removed). Points need a little room: shadow rays start off their surface, see slack().
struct Receiver {
  Vec3f point, normal;
  uint32_t object = scene::kNone;  ///< the movable that it lies on
  float plane = 0;                 ///< scene::Scene::slack_of what it lies on
  uint64_t key = 0;                ///< of random numbers that stay while it moves
  float slack() const { return position_slack(point) + plane; }
  friend bool operator==(const Receiver&, const Receiver&) = default;
};

/// Of a place, never of its number: other samples change nothing.
uint64_t place_key(Vec3f point, Vec3f normal);

/// How finely a light is looked at; a punctual one has one ray in either.
enum class Detail : uint8_t { coarse, fine };
inline constexpr uint32_t kCoarseRays = 36, kFineRays = 256;
/// Rays to the ends of an area light, besides those: they tell open from partly hidden, no more.
inline constexpr uint32_t kCorners = 4;

/// Shadow rays to a light and what each stands for.
struct Strata {
  trace::RayFan fan;
  alignas(
      64) std::array<float, trace::RayFan::kMaxRays> weight;  ///< share of the light, not normed
  trace::RayBits countable{};  ///< rays with weight: those in front of the receiver and the light
  bool too_coarse = false;     ///< the light is near or large: look in fine detail

  /// Share of the light that the rays in `seen` (a subset of `countable`) stand for, in [0, 1].
  double share(const trace::RayBits& seen) const;
};

class LightShape {
 public:
  /// `number`: of the light; with `seed` and the receiver it determines the strata's points.
  LightShape(const trace::Light& light, uint32_t number, uint64_t seed);

  /// Irradiance that the unblocked light gives, as a factor of brightest(): exact for area lights.
  double open(const Receiver& receiver) const;
  /// The same at a glance: zero only where open() is, else within a few times of it for receivers
  /// that the light is not close to.
  double about(const Receiver& receiver) const;
  /// Whether the light is small as seen from the receiver, so that its points give about the same.
  bool is_small(const Receiver& receiver) const;
  /// One shadow ray to a point drawn evenly from its surface, `u` and `v` in [0, 1), and the
  /// irradiance where nothing is between, as a factor of brightest(): unbiased.
  struct Glance {
    Vec3f origin, direction;
    float to;
    double irradiance;
  };
  Glance glance(const Receiver& receiver, float u, float v) const;
  /// Radiance or intensity of the strongest channel.
  double brightest() const { return brightest_; }
  void cast(const Receiver& receiver, Detail detail, Strata& out) const;

 private:
  struct Triangle {
    Vec3f corner, edge_u, edge_v, normal;
    float area, longest_squared, slack;
    float before, share;  // cumulative share of the light's area before it, and its own
  };
  struct Corner {
    Vec3f point, normal;
    float slack;
  };
  void find_corners(Vec3f centre);
  double open_triangle(const Triangle& triangle, const Receiver& receiver) const;
  bool is_area() const { return !punctual_.kind; }
  double open_punctual(const Receiver& receiver) const;
  void cast_single(const Receiver& receiver, Strata& out) const;
  void cast_area(const Receiver& receiver, Detail detail, Strata& out) const;
  void cast_triangle(const Receiver& receiver, Triangle triangle, const float* a, const float* b,
                     size_t begin, size_t end, Strata& out) const;
  void cast_corners(const Receiver& receiver, Strata& out) const;
  const Triangle& triangle_at(float position) const;

  lights::Punctual punctual_;  // of no kind: an area light
  Vec3f centre_{};             // of an area light
  float radius_ = 0;           // around it
  Vec3f facing_{};             // of a flat one its normal, else zero
  std::vector<Triangle> triangles_;
  std::array<Corner, kCorners> corners_;
  bool two_sided_, on_;
  uint64_t key_;
  float area_ = 0;
  double brightest_;
  uint32_t rows_[2] = {1,
                       1};  // per detail: strata across a triangle; columns run along the triangles
};

}  // namespace deltalux::direct
