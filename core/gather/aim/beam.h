// SPDX-License-Identifier: Apache-2.0
// Tracks where a narrow spot's light lands at present: points that gather rays are sent to, even if
// something stands in between.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "direct/light_shape.h"
#include "trace/change.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// A narrow spot that gather rays are sent towards, as the bake found it.
struct BeamGuide {
  uint32_t light;
  /// Power that the first landings reflect, sum of all channels, as if all light of the spot
  /// landed.
  float power;
  /// Median irradiance of the places that see them.
  float around;
  /// Why these data are invalid; null if they are valid. `lights`: those of the scene.
  const char* flaw(std::span<const trace::Light> lights) const;
};

/// Points spread over the light of one spot in proportion to its power. A pure function of the
/// present scene.
class Beam {
 public:
  static constexpr uint32_t kSide = 64, kPoints = kSide * kSide;
  /// A point where light of the spot lands.
  struct Point {
    /// Where the light leaves the scene, `at` lies outside of the world, and the normal is zero.
    Vec3f at, normal;                   ///< the normal faces the lamp
    uint32_t primitive = scene::kNone;  ///< kNone: the light leaves the scene
    bool valid() const { return primitive != scene::kNone; }
    /// The unit direction from `origin` to the point; zero if `origin` is behind the surface there.
    Vec3f seen_from(Vec3f origin) const;
    /// Whether the ray from `origin` along `w` hit this point.
    bool is_met(Vec3f origin, Vec3f w, const trace::Hit& hit) const;
    friend bool operator==(const Point&, const Point&) = default;
  };
  /// Only for lights for which is_narrow() holds. `beyond`: a distance from the lamp that is
  /// outside of the world.
  Beam(const trace::Light& light, const BeamGuide& guide, float beyond, uint64_t seed);
  /// Whether the light is a spot of at most 45 degrees from axis to edge.
  static bool is_narrow(const trace::Light& light);

  const BeamGuide& guide() const { return guide_; }
  /// Casts a ray for each point.
  void compute(const trace::RayCaster& caster);
  /// Recasts the points that a change of other things than the lamp may affect; sets differs[k] = 1
  /// where point k differs. Returns whether any does.
  bool update(const trace::RayCaster& caster, const trace::Change& change,
              std::span<uint8_t> differs);

  const Point& point(uint32_t k) const { return points_[k]; }
  /// Index of the point for a place in the unit square.
  static uint32_t number(float u, float v) {
    return uint32_t(v * kSide) * kSide + uint32_t(u * kSide);
  }
  /// The probability density per solid angle with which a point is drawn in direction `w`, times
  /// pi, for a ray that lands at distance `t`. `at`: where it lands, facing the ray. Sets `in_beam`
  /// if the result depends on what stands between that place and the lamp.
  float density(Vec3f w, float t, const direct::Receiver& at, const trace::RayCaster& caster,
                bool& in_beam) const;

  /// Whether the beam's light may reach a place in the ball; false only if none can.
  bool may_meet(Vec3f centre, float radius) const;
  bool may_meet(const Box& box) const;  ///< the same for a box

  // The following functions depend on the lamp and on static geometry only, so that few edits
  // change sampling probabilities.
  /// Approximately the beam's share of a receiver's indirect light, unshadowed, or the share that
  /// it could have if something stood in the beam's way.
  float share(Vec3f from, Vec3f n) const;
  /// The same in more detail: `irradiance` from its points, and the mean `square` of what one
  /// cosine-distributed ray brings.
  struct Brought {
    float irradiance = 0, square = 0;
    float perhaps = 0;  ///< irradiance if something stood in the beam's way
  };
  Brought brought(Vec3f from, Vec3f n) const;
  /// How bright an object might become that was placed there: its irradiance from the light that
  /// the first landings reflect, relative to the irradiance of their surroundings.
  float beside(Vec3f place) const;
  /// The largest radiosity where its light lands.
  float brightest() const { return brightest_; }
  /// The k-th visibility test: whether a receiver sees a place where the beam's light lands, or
  /// might land. `random`: the receiver's random numbers.
  bool sees(uint32_t k, const trace::RayCaster& caster, Vec3f from, Vec3f n,
            const PathRandom& random) const;

 private:
  /// Direction of the k-th point, seen from the lamp.
  Vec3f direction(uint32_t k) const;
  /// `closest`: (origin, direction, from) -> Hit.
  template <class Caster>
  Point cast(uint32_t k, const Caster& closest) const;
  Point cast(const trace::RayCaster& caster, uint32_t k) const;
  void find_middle(const trace::RayCaster& caster);
  float perhaps(Vec3f from, Vec3f n) const;

  lights::Punctual light_;
  bool on_;
  std::shared_ptr<const direct::LightShape> shape_;
  BeamGuide guide_;
  float beyond_;
  float per_solid_;  // probability density per solid angle where the spot is brightest
  uint64_t key_;
  std::vector<Point> points_;
  // Computed without movable objects; a negative extent means that no light lands.
  std::vector<Point> few_;
  std::vector<float> radiosity_;  // of the points in few_
  Vec3f middle_{}, normal_{};
  float extent_ = -1, rise_ = 0, brightest_ = 0;
};

}  // namespace deltalux::gather
