// SPDX-License-Identifier: Apache-2.0
// Tracks where a narrow spot's light lands at present: points that gather rays are sent to, even if
// something stands in between.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/random.h"
#include "direct/light_shape.h"
#include "gather/aim/target.h"
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

/// Points spread over the light of one spot in proportion to its power, where it lands or leaves
/// the scene. A pure function of the present scene.
class Beam final : public Target {
 public:
  static constexpr uint32_t kSide = 64, kPoints = kSide * kSide;
  using Point = AimPoint;
  /// Only for lights for which is_narrow() holds. `number`: among the scene's beams. `beyond`: a
  /// distance from the lamp that is outside of the world.
  Beam(const trace::Light& light, const BeamGuide& guide, uint32_t number, float beyond,
       uint64_t seed);
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
  Aim aim(Vec3f from, float u, float v) const override {
    const Point& point = points_[number(u, v)];
    return {point.seen_from(from), &point};
  }
  float density(const LandedRay& ray, bool& in_beam) const override;
  bool may_meet(Vec3f, Vec3f, float) const override { return true; }
  bool has_points() const override { return true; }
  size_t point_number(float u, float v) const override {
    return size_t(number_) * kPoints + number(u, v);
  }

  /// Whether the beam's light may reach a place in the ball; false only if none can.
  bool may_reach(Vec3f centre, float radius) const;
  bool may_reach(const Box& box) const;  ///< the same for a box

  // The following functions depend on the lamp and on static geometry only.
  /// Unshadowed; or what it could bring if something stood in the beam's way, if that is more.
  float share(Vec3f from, Vec3f n) const override;
  /// The same in more detail, what it could bring included.
  Expected expected(Vec3f from, Vec3f n) const override;
  /// Irradiance from where its light lands, unshadowed.
  float brought(Vec3f from, Vec3f n) const { return from_points(from, n).irradiance; }
  /// How bright an object might become that was placed there: its irradiance from the light that
  /// the first landings reflect, relative to the irradiance of their surroundings.
  float beside(Vec3f place) const;
  /// Tests a place where the beam's light lands, or might land.
  void look(uint32_t k, const PathRandom& random, VisibilityTest& test,
            uint32_t& seen) const override;

 private:
  /// Direction of the k-th point, seen from the lamp.
  Vec3f direction(uint32_t k) const;
  /// `closest`: (origin, direction, from) -> Hit.
  template <class Caster>
  Point cast(uint32_t k, const Caster& closest) const;
  Point cast(const trace::RayCaster& caster, uint32_t k) const;
  void find_middle(const trace::RayCaster& caster);
  float perhaps(Vec3f from, Vec3f n) const;
  struct Brought {
    float irradiance = 0, square = 0;
  };
  Brought from_points(Vec3f from, Vec3f n) const;

  lights::Punctual light_;
  bool on_;
  std::shared_ptr<const direct::LightShape> shape_;
  BeamGuide guide_;
  uint32_t number_;
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
