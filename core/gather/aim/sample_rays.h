// SPDX-License-Identifier: Apache-2.0
// The gather rays of one sample: most are cosine-distributed, some go towards targets; and their
// weights.
#pragma once
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "base/archive.h"
#include "direct/light_shape.h"
#include "gather/aim/directions.h"
#include "gather/aim/ray_counts.h"
#include "gather/aim/targets.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

inline constexpr uint32_t kParts = 8;    // parts of a sample's rays, each an estimate by itself
inline constexpr uint32_t kMaxUsed = 8;  // targets per sample

/// How many of a sample's rays go towards each target (by Targets::number), counted per part (an
/// eighth) of the rays: all parts have the same numbers.
struct RayAllotment {
  std::array<uint16_t, kMaxUsed> target{}, eighth{};
  /// Guided rays in one part.
  uint32_t guided() const {
    uint32_t sum = 0;
    for (uint16_t own : eighth) sum += own;
    return sum;
  }
  friend bool operator==(const RayAllotment&, const RayAllotment&) = default;
};

/// The guides of a session, which are chosen at the bake, and the numbers and allotments of all
/// samples' rays.
struct Guiding {
  std::vector<Guide> guides;
  std::vector<BeamGuide> beams;
  std::vector<uint32_t> suns;  ///< indices of lights, ascending, see Suns
  RayNeed need;
  std::vector<int8_t> doublings;  ///< by sample: log2 of the factor on the standard number of rays
  std::vector<RayAllotment> allotments;  ///< by sample; empty without guides
  /// Whether all rays are cosine-distributed.
  bool empty() const { return guides.empty() && beams.empty(); }
  size_t bytes() const {
    return guides.capacity() * sizeof(Guide) + beams.capacity() * sizeof(BeamGuide) +
           suns.capacity() * sizeof(uint32_t) + allotments.capacity() * sizeof(RayAllotment) +
           doublings.capacity();
  }
  /// Writes arrays named "gather.…". `current`: whether the allotments are those of the present
  /// scene; they are only written then.
  void save(ArchiveView& archive, bool current) const;
  /// The same for samples [first, last) alone, whose allotments are current.
  void save_samples(size_t first, size_t last, ArchiveView& archive) const;
  /// Restores what save() wrote; leaves `allotments` empty if they were not saved. `rays`: the
  /// standard number. Throws FormatError; this object is then useless.
  void restore(ArchiveSource& archive, std::span<const trace::Light> lights, size_t samples,
               uint32_t rays);
};

/// The targets that a receiver sees, the noisiest first.
struct SeenTargets {
  struct Seen {
    float share;      ///< the target's light, relative to the receiver's
    uint16_t target;  ///< by Targets::number
  };
  std::array<Seen, kMaxUsed> each{};
  uint32_t count = 0;
};

/// Finds the targets that a receiver sees. `rays`: the standard number. The result depends on the
/// receiver, the lamps and static geometry only, so that few edits change it. Casts some hundred
/// rays.
SeenTargets see_targets(const Targets& targets, const direct::Receiver& receiver, uint32_t rays,
                        const trace::RayCaster& caster, uint64_t seed);
/// How a receiver with `rays` rays divides them.
RayAllotment allot_rays(const SeenTargets& seen, uint32_t rays);

/// Weights of multiple importance sampling by the power heuristic (Veach & Guibas 1995). With the
/// balance heuristic, the few cosine-distributed rays that hit a pool of light bring as much noise
/// as all others together.
class PowerHeuristic {
 public:
  /// `expected`: the density of rays per solid angle for one technique; `own`: whether that
  /// technique drew this ray.
  PowerHeuristic(double expected, bool own) { add(expected, own); }
  void add(double expected, bool own) {
    if (own) own_ = expected;
    squares_ += expected * expected;
  }
  /// `wanted`: the density for which rays would have weight 1. Returns 0 if the weight is not
  /// finite.
  float weight(double wanted) const {
    const float weight = float(wanted * own_ / squares_);
    return std::isfinite(weight) ? weight : 0.0f;
  }

 private:
  double own_ = 0, squares_ = 0;
};

/// The directions and weights of a sample's rays.
class SampleRays {
 public:
  /// `allotments`: those of all samples, see Guiding.
  SampleRays(const Directions& directions, std::span<const RayAllotment> allotments,
             const Targets& targets, uint32_t sample, uint32_t rays,
             const direct::Receiver& receiver);
  uint32_t count() const { return count_; }
  Vec3f origin() const { return origin_; }
  bool has_guides() const { return guided_ > 0; }
  /// Where the ray goes.
  Aim aim(uint32_t ray) const;
  /// Two random numbers for what happens where the ray lands; well distributed over the sample's
  /// rays.
  std::array<float, 2> beyond(uint32_t ray) const;
  /// The weight of the light along a ray that lands at distance `t`; 1 without guides. `at`: where
  /// it lands, facing the ray. Sets `in_beam` if the result depends on what stands between that
  /// place and a lamp.
  float weight(uint32_t ray, Vec3f w, float t, const direct::Receiver& at,
               const trace::RayCaster& caster, bool& in_beam) const;
  /// Calls visit(ray) for the rays towards points that changed. `moved_points`: BeamChange::points.
  template <class Visit>
  void each_moved(std::span<const uint8_t> moved_points, const Visit& visit) const {
    for (uint32_t slot = 0; slot < kMaxUsed; ++slot) {
      if (!target_[slot] || !target_[slot]->has_points()) continue;
      each_of_slot(slot, [&](uint32_t ray, uint32_t number) {
        const auto [u, v] = directions_.point(key_, slot + 1, number);
        if (moved_points[target_[slot]->point_number(u, v)]) visit(ray);
      });
    }
  }

  /// Calls visit(ray) for all rays that may meet the ball, and for a few others.
  template <class Visit>
  void each_towards(Vec3f centre, float radius, const Visit& visit) const {
    const Vec3f to_centre = centre - origin_;
    const uint32_t even = count_ - kParts * guided_;
    directions_.each_towards(key_, even, normal_, to_centre, radius,
                             [&](uint32_t number) { visit(ray_of_even(number)); });
    for (uint32_t slot = 0; slot < kMaxUsed; ++slot)
      if (target_[slot] && target_[slot]->may_meet(origin_, to_centre, radius))
        each_of_slot(slot, [&](uint32_t ray, uint32_t) { visit(ray); });
  }

 private:
  /// Index behind the last ray of a part.
  uint32_t end_of(uint32_t part) const { return uint32_t(uint64_t(count_) * (part + 1) / kParts); }
  /// Calls visit(ray, its index within the slot).
  template <class Visit>
  void each_of_slot(uint32_t slot, const Visit& visit) const {
    uint32_t before = 0;
    for (uint32_t k = 0; k < slot; ++k) before += allotment_.eighth[k];
    for (uint32_t part = 0; part < kParts; ++part)
      for (uint32_t k = 0; k < allotment_.eighth[slot]; ++k)
        visit(end_of(part) - guided_ + before + k, part * allotment_.eighth[slot] + k);
  }
  /// Index of the number-th cosine-distributed ray.
  uint32_t ray_of_even(uint32_t number) const;
  /// The slot of the target that a ray aims for, and its index within the slot. Slot kMaxUsed:
  /// cosine-distributed.
  std::pair<uint32_t, uint32_t> slot_of(uint32_t ray) const;

  const Directions& directions_;
  uint64_t key_;  // the receiver's random key
  uint32_t count_;
  Vec3f origin_, normal_;
  uint32_t guided_ = 0;  // guided rays in each part
  RayAllotment allotment_;
  std::array<const Target*, kMaxUsed> target_{};  // by slot; null if the slot has no rays
  GuideSquares<kMaxUsed> squares_;                // of those targets that are squares
};

}  // namespace deltalux::gather
