// SPDX-License-Identifier: Apache-2.0
// Where a narrow spot's light lands now: points that rays are sent to, whatever stands in its way.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "direct/light_shape.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// A spot whose light is worth rays of its own, as the bake found it.
struct BeamGuide {
  uint32_t light;
  float power;   ///< that its first landings send on, all channels; as if all of it landed
  float around;  ///< irradiance of those samples that see them
  /// Why rays can't follow it; null where they can. `lights`: of the scene.
  const char* flaw(std::span<const trace::Light> lights) const;
};

/// Points spread over the light of one spot by its power: a pure function of the present scene.
class Beam {
 public:
  static constexpr uint32_t kSide = 64, kPoints = kSide * kSide;
  struct Point {
    Vec3f at, normal;                   ///< the normal faces the lamp
    uint32_t primitive = scene::kNone;  ///< kNone: light that leaves the scene
    bool valid() const { return primitive != scene::kNone; }
    /// Unit, from there; zero where its back would be seen.
    Vec3f seen_from(Vec3f origin) const;
    /// Whether it is what the ray from `origin` along `w` met.
    bool is_met(Vec3f origin, Vec3f w, const trace::Hit& hit) const;
    friend bool operator==(const Point&, const Point&) = default;
  };
  /// Of those that is_narrow() holds for.
  Beam(const trace::Light& light, const BeamGuide& guide, uint64_t seed);
  static bool is_narrow(const trace::Light& light);

  const BeamGuide& guide() const { return guide_; }
  /// Whether the lamp has moved, or was switched.
  bool differs(const trace::Light& light) const;
  /// Casts all points.
  void compute(const trace::RayCaster& caster);
  /// Casts again what a change in these boxes may touch; changed[k] = 1 where a point differs.
  /// False where nothing of the beam meets them.
  bool update(const trace::RayCaster& caster, std::span<const Box> boxes,
              std::span<uint8_t> changed);

  const Point& point(uint32_t k) const { return points_[k]; }
  /// The point of a place in the unit square.
  static uint32_t number(float u, float v) {
    return uint32_t(v * kSide) * kSide + uint32_t(u * kSide);
  }
  /// Of a ray along `w` that lands `t` away: chance per solid angle that a point lies there, times
  /// pi. `at`: the place, facing the ray. Sets `in_beam` where what stands before the lamp decides.
  float density(Vec3f w, float t, const direct::Receiver& at, const trace::RayCaster& caster,
                bool& in_beam) const;

  /// False only where no place in the ball can take its light.
  bool may_meet(Vec3f centre, float radius) const;

  // What follows does not depend on what moves: chances of rays stay as they are.
  /// About what of a receiver's light the beam brings, unshadowed, or may bring if something stood
  /// in its way.
  float share(Vec3f from, Vec3f n) const;
  /// The same in more detail: irradiance that its points bring, and the mean square of what one
  /// cosine-distributed ray does.
  struct Brought {
    float irradiance = 0, square = 0;
    float perhaps = 0;  ///< irradiance, if something stood in its way
  };
  Brought brought(Vec3f from, Vec3f n) const;
  /// Irradiance of a thing that stood there, by what the light's first landings send on, in that of
  /// their surroundings: how bright it might become.
  float beside(Vec3f place) const;
  /// Radiosity where its light lands, the most of it.
  float brightest() const { return brightest_; }
  /// Whether a receiver sees one of the places where its light lands, or might: the k-th look.
  bool sees(uint32_t k, const trace::RayCaster& caster, Vec3f from, Vec3f n,
            const PathRandom& random) const;

 private:
  Vec3f direction(uint32_t k) const;
  /// `closest`: (origin, direction, from) -> Hit.
  template <class Caster>
  Point cast(uint32_t k, const Caster& closest) const;
  Point cast(const trace::RayCaster& caster, uint32_t k) const;
  void find_middle(const trace::RayCaster& caster);
  float perhaps(Vec3f from, Vec3f n) const;

  lights::Punctual light_;
  bool on_;
  direct::LightShape shape_;
  BeamGuide guide_;
  float per_solid_;  // chance per solid angle where the spot is brightest
  uint64_t key_;
  std::vector<Point> points_;
  // As if nothing that moves were there; a negative extent: nothing is.
  std::vector<Point> few_;
  std::vector<float> radiosity_;  // of those
  Vec3f middle_{}, normal_{};
  float extent_ = -1, rise_ = 0, brightest_ = 0;
};

}  // namespace deltalux::gather
