// SPDX-License-Identifier: Apache-2.0
// A light as receivers see it: unshadowed irradiance, and shadow rays.
#pragma once
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "base/random.h"
#include "base/vec.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// A surface point whose irradiance is computed. A zero normal (of a removed object) receives none.
/// Shadow rays start slightly off the surface, see slack().
struct Receiver {
  Vec3f point, normal;
  uint32_t object = scene::kNone;  ///< the movable that it lies on, or kNone
  /// Scene::slack_of() of the surface that it lies on.
  float plane = 0;
  uint64_t key = 0;  ///< key of random numbers, which stay the same when its object moves
  float slack() const { return position_slack(point) + plane; }
  friend bool operator==(const Receiver&, const Receiver&) = default;
};

/// A key that depends on the place only, not on the sample's index, so that other samples do not
/// affect it.
uint64_t place_key(Vec3f point, Vec3f normal);

/// How many shadow rays sample a light; a punctual light has one ray in any. Middle: the coarse
/// ones without those to the extremities.
enum class Detail : uint8_t { coarse, middle, fine };
inline constexpr uint32_t kCoarseRays = 36, kFineRays = 256;
/// Additional rays to the extremities of an area light: they only distinguish full from partial
/// visibility.
inline constexpr uint32_t kCorners = 4;
/// A fine stratum that is divided gets kParts x kParts rays.
inline constexpr uint32_t kParts = 4, kDivided = kFineRays / (kParts * kParts);

/// Bits of the coarse rays, and of those to the extremities.
inline constexpr uint64_t kCoarseBits = (uint64_t(1) << kCoarseRays) - 1;
inline constexpr uint64_t kCornerBits = ((uint64_t(1) << kCorners) - 1) << kCoarseRays;
static_assert(kCoarseRays == 36);
/// Bits of a third (0 to 2) of the coarse rays, equally many in each row and column of the strata.
constexpr uint64_t few_rays(uint32_t third) {
  constexpr uint64_t kFewRays = 0x88c462311;
  return (kFewRays << 3 * third | kFewRays >> (kCoarseRays - 3 * third)) & kCoarseBits;
}

/// Shadow rays to a light, and what each represents.
struct Strata {
  trace::RayFan fan;
  alignas(
      64) std::array<float, trace::RayFan::kMaxRays> weight;  ///< unnormalised share of the light
  trace::RayBits countable{};  ///< rays in front of both the receiver and the light
  trace::RayBits nearly{};     ///< of divide(): rays in whose strata some points are
  /// how many strata lie beside each other across the light's triangles; the next column follows
  uint32_t rows = 1;
  /// whether the light is close or large, so that fine detail is needed
  bool too_coarse = false;

  /// The share of the light, in [0, 1], that the rays in `seen` (a subset of `countable`)
  /// represent.
  double share(const trace::RayBits& seen) const;
};

/// A light as receivers see it. Lights with a surface and lights without one are sampled each in
/// their own way, see shape_of().
class LightShape {
 public:
  virtual ~LightShape() = default;

  /// Unshadowed irradiance, in units of brightest(); exact for lights with a surface.
  double open(const Receiver& receiver) const { return receives(receiver) ? full(receiver) : 0; }
  /// A fast approximation of open(): zero only if open() is zero; otherwise within a small factor
  /// of it, unless the receiver is close to the light.
  double about(const Receiver& receiver) const { return receives(receiver) ? rough(receiver) : 0; }
  /// Whether about() may be more than 0 for a receiver in the box; false only if it is for none.
  bool may_light(const Box& points) const { return on_ && may_reach(points); }
  /// Whether the light is small as seen from the receiver, so that all its points contribute about
  /// equally.
  virtual bool is_small(const Receiver&) const { return true; }
  /// Whether open() takes much longer than the rays of cast(); what that is by all rays of a level
  /// on average.
  virtual bool has_many_parts() const { return false; }
  virtual double by_strata(const Strata&) const { return 0; }
  /// One shadow ray to a point drawn from the light's surface, by power, by `u` and `v` in [0, 1),
  /// and the irradiance if it is unoccluded, in units of brightest(). The estimate is unbiased.
  struct Glance {
    Vec3f origin{}, direction{};
    float to = 0;
    double irradiance = 0;  ///< if this is 0, there may be no ray
  };
  virtual Glance glance(const Receiver& receiver, float u, float v) const = 0;
  /// Radiance, or intensity, of the strongest channel.
  double brightest() const { return brightest_; }
  /// Points whose convex hull contains the light's surface: the corners of few triangles, or of a
  /// box. Empty for a light without a surface.
  virtual std::span<const Vec3f> outline() const { return {}; }
  /// Whether the light can give the receiver only a small share of what receivers get.
  virtual bool is_minor(const Receiver&) const { return false; }
  /// Whether a light that gives so much where nothing hides it is one of few that matter.
  virtual bool is_major(double) const { return true; }
  /// Makes the shadow rays of a level. A light that is minor, or very small as seen from the
  /// receiver, gets a third of the coarse rays; one that gives next to nothing gets a single one. A
  /// minor light's fine rays are all 36. A light without a surface gets one ray.
  virtual void cast(const Receiver& receiver, Detail detail, Strata& out) const = 0;
  /// The squared distance of neighbours among so many cells of equal area; 0 for a light of few
  /// triangles, whose grid of cells tells it.
  virtual float near(size_t) const { return 0; }
  /// Of random numbers for this light and receiver.
  uint64_t key(const Receiver& receiver) const {
    return combine(key_, place_key(receiver.point, receiver.normal));
  }
  /// Makes rays to cells of a light's surface: to parts x parts places in each. Cells at depth 0
  /// are the fine strata, at depth 1 their parts: a grid of kParts times as many rows and columns.
  /// Both are numbered column by column. Together at most kFineRays rays.
  struct Cells {
    std::span<const uint32_t> numbers;  ///< ascending
    uint32_t depth, parts;
  };
  /// Only for lights with a surface, the others of which have no strata that could be divided.
  virtual void divide(const Receiver& receiver, const Cells& cells, Strata& out) const;

 protected:
  LightShape(const trace::Light& light, uint32_t number, uint64_t seed);
  static Vec3f origin(const Receiver& receiver) {
    return receiver.point + receiver.normal * receiver.slack();
  }

 private:
  bool receives(const Receiver& receiver) const { return on_ && !(receiver.normal == Vec3f{}); }
  /// open() and about() where the light is on and the receiver has a side.
  virtual double full(const Receiver& receiver) const = 0;
  virtual double rough(const Receiver& receiver) const { return full(receiver); }
  virtual bool may_reach(const Box& points) const = 0;

  bool on_;
  uint64_t key_;
  double brightest_;
};

/// The shape of a light. `number`: index of the light; with `seed` and the receiver it determines
/// the points in the strata. `reference`: of what receivers get from all lights, to tell lights
/// that matter little; 0 if all matter.
std::unique_ptr<const LightShape> shape_of(const trace::Light& light, uint32_t number,
                                           uint64_t seed, double reference = 0);
/// By light; null for lights that do not take part.
using Shapes = std::vector<std::unique_ptr<const LightShape>>;

}  // namespace deltalux::direct
