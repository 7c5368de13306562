// SPDX-License-Identifier: Apache-2.0
// Interface of what gather rays are aimed at: small bright places, whatever makes them bright.
#pragma once
#include <cstddef>
#include <cstdint>

#include "base/random.h"
#include "direct/light_shape.h"
#include "gather/aim/visibility_test.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

struct Guide;

/// A point that a ray aims for and must hit; where light leaves the scene, `at` lies outside of the
/// world, and the normal is zero.
struct AimPoint {
  Vec3f at, normal;                   ///< the normal faces the lamp
  uint32_t primitive = scene::kNone;  ///< kNone: the light leaves the scene
  bool valid() const { return primitive != scene::kNone; }
  /// The unit direction from `origin` to the point; zero if `origin` is behind the surface there.
  Vec3f seen_from(Vec3f origin) const;
  /// Whether the ray from `origin` along `w` hit this point.
  bool is_met(Vec3f origin, Vec3f w, const trace::Hit& hit) const;
  friend bool operator==(const AimPoint&, const AimPoint&) = default;
};

/// The direction of a ray.
struct Aim {
  Vec3f w{};  ///< unit; zero: the ray is not cast and brings nothing
  /// the point that the ray must hit; otherwise it brings nothing
  const AimPoint* point = nullptr;
  uint32_t target = scene::kNone;  ///< in a DirectionSampler: which one drew it; kNone: none did
};

/// A ray that hit something at distance `t`.
struct LandedRay {
  Vec3f from, w;
  float t;
  const direct::Receiver& at;  ///< where it landed, facing the ray
  const trace::RayCaster& caster;
};

/// What a receiver may get from a target, if nothing hides it.
struct Expected {
  float square;      ///< mean square of what one cosine-distributed ray brings
  float irradiance;  ///< sum of all channels
  float around;      ///< median irradiance of the places that see the target
};

/// Something small and bright that rays are sent towards. The functions from expected() on depend
/// on lamps and static geometry only, so that few edits change sampling probabilities.
class Target {
 public:
  virtual ~Target() = default;
  /// A direction from a place, drawn by `u` and `v`, random in [0, 1).
  virtual Aim aim(Vec3f from, float u, float v) const = 0;
  /// The probability density per solid angle, times pi, with which aim() draws the ray's direction.
  /// Sets `in_beam` if that depends on what stands between where it landed and a lamp.
  virtual float density(const LandedRay& ray, bool& in_beam) const = 0;
  /// Whether a ray that aim() draws from a place may meet the ball; false only if none can.
  virtual bool may_meet(Vec3f from, Vec3f to_ball, float radius) const = 0;
  /// Whether rays aim for points, which edits may change.
  virtual bool has_points() const { return false; }
  /// Index, among the points of all targets, of the one that aim() chooses by `u` and `v`.
  virtual size_t point_number(float, float) const { return 0; }

  virtual Expected expected(Vec3f from, Vec3f n) const = 0;
  /// Approximately what it brings to a receiver, relative to the light around.
  virtual float share(Vec3f from, Vec3f n) const = 0;
  /// The k-th test whether the receiver of `test` sees the target; adds 1 to `seen` if it does, at
  /// once or when the test ends. `random`: the receiver's random numbers.
  virtual void look(uint32_t k, const PathRandom& random, VisibilityTest& test,
                    uint32_t& seen) const = 0;
  /// The square that holds all of it; null if there is none.
  virtual const Guide* square() const { return nullptr; }
};

}  // namespace deltalux::gather
