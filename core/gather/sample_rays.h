// SPDX-License-Identifier: Apache-2.0
// The rays of one sample: most spread evenly, some towards guides, and what each weighs.
#pragma once
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "base/archive.h"
#include "direct/light_shape.h"
#include "gather/beams.h"
#include "gather/directions.h"
#include "gather/guide.h"
#include "gather/ray_counts.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

inline constexpr uint32_t kParts = 8;    // of the rays, each an estimate by itself
inline constexpr uint32_t kMaxUsed = 8;  // guides of one sample, beams included

/// How many of a sample's rays go towards guides. In eighths: each part of the rays has the same
/// share of them.
struct RayShares {
  static constexpr uint16_t kFirstBeam = kMaxGuides;  ///< in `guide`
  std::array<uint16_t, kMaxUsed> guide{}, eighth{};
  /// In one part of the rays.
  uint32_t guided() const {
    uint32_t sum = 0;
    for (uint16_t own : eighth) sum += own;
    return sum;
  }
  friend bool operator==(const RayShares&, const RayShares&) = default;
};

/// Guides are chosen once, at the bake.
struct Guiding {
  std::vector<Guide> guides;
  std::vector<BeamGuide> beams;
  std::vector<uint32_t> suns;  ///< lights, ascending: see Suns
  RayNeed need;
  std::vector<int8_t> doublings;  ///< of the standard number of rays, per sample
  std::vector<RayShares> shares;  ///< per sample; empty without guides
  /// Whether all rays are even ones.
  bool empty() const { return guides.empty() && beams.empty(); }
  size_t bytes() const {
    return guides.capacity() * sizeof(Guide) + beams.capacity() * sizeof(BeamGuide) +
           suns.capacity() * sizeof(uint32_t) + shares.capacity() * sizeof(RayShares) +
           doublings.capacity();
  }
  /// Arrays named "gather.…"; shares where samples have `current` ones, of the scene as it is.
  void save(ArchiveView& archive, bool current) const;
  /// Without shares where none were kept. `rays`: the standard number. Throws FormatError: then
  /// this object is of no use.
  void restore(ArchiveSource& archive, std::span<const trace::Light> lights, size_t samples,
               uint32_t rays);
};

/// The guides, beams included, that a receiver sees, the noisiest first.
struct SeenGuides {
  struct Seen {
    float share;  ///< its light, of the receiver's
    uint16_t guide;
  };
  std::array<Seen, kMaxUsed> each{};
  uint32_t count = 0;
};

/// Of a receiver where `rays` is the standard number; follows from the receiver, the lamps and what
/// does not move, so that few edits change it. It casts some hundred rays itself.
SeenGuides see_guides(std::span<const Guide> guides, const Beams& beams,
                      const direct::Receiver& receiver, uint32_t rays,
                      const trace::RayCaster& caster, uint64_t seed);
/// Shares of a receiver that casts `rays`.
RayShares share_rays(const SeenGuides& seen, uint32_t rays);

/// Where a ray goes.
struct Aim {
  Vec3f w{};                           ///< unit; zero: nowhere, it brings nothing
  const Beam::Point* point = nullptr;  ///< what it has to meet, or it brings nothing
  uint32_t guide = scene::kNone;       ///< of a Turn: whose it is; kNone: nobody's
};

/// Weights of multiple importance sampling (Veach & Guibas 1995). With the balance heuristic the
/// few even rays that meet a pool bring as much noise as all others together.
class PowerHeuristic {
 public:
  /// `expected`: how many rays one way of drawing them sends per solid angle; `own`: it drew this.
  PowerHeuristic(double expected, bool own) { add(expected, own); }
  void add(double expected, bool own) {
    if (own) own_ = expected;
    squares_ += expected * expected;
  }
  /// `wanted`: what rays whose light counts once would be. 0 where that is no number.
  float weight(double wanted) const {
    const float weight = float(wanted * own_ / squares_);
    return std::isfinite(weight) ? weight : 0.0f;
  }

 private:
  double own_ = 0, squares_ = 0;
};

class SampleRays {
 public:
  SampleRays(const Directions& directions, const Guiding& guiding, const Beams& beams,
             uint32_t sample, uint32_t rays, const direct::Receiver& receiver);
  uint32_t count() const { return count_; }
  Vec3f origin() const { return origin_; }
  bool has_guides() const { return guided_ > 0; }
  Aim aim(uint32_t ray) const;
  /// Two random numbers for what happens where the ray lands, evenly spread over the rays.
  std::array<float, 2> beyond(uint32_t ray) const;
  /// What the light along a ray that lands at distance `t` counts times; 1 without guides. `at`:
  /// where it lands, facing it. Sets `in_beam` where what stands before a lamp decides.
  float weight(uint32_t ray, Vec3f w, float t, const direct::Receiver& at,
               const trace::RayCaster& caster, bool& in_beam) const;
  /// Calls visit(ray) for rays towards points that differ. `moved_points`: BeamChange::points.
  template <class Visit>
  void each_moved(std::span<const uint8_t> moved_points, const Visit& visit) const {
    for (uint32_t slot = 0; slot < kMaxUsed; ++slot) {
      if (!beam_[slot]) continue;
      const size_t beam = shares_.guide[slot] - RayShares::kFirstBeam;
      each_of_slot(slot, [&](uint32_t ray, uint32_t number) {
        if (moved_points[beam * Beam::kPoints + point_of(slot, number)]) visit(ray);
      });
    }
  }

  /// Calls visit(ray) for all rays that may meet the ball, and for few others.
  template <class Visit>
  void each_towards(Vec3f centre, float radius, const Visit& visit) const {
    const Vec3f to_centre = centre - origin_;
    const uint32_t even = count_ - kParts * guided_;
    directions_.each_towards(key_, even, normal_, to_centre, radius,
                             [&](uint32_t number) { visit(ray_of_even(number)); });
    for (uint32_t slot = 0; slot < kMaxUsed; ++slot)
      if (shares_.eighth[slot] && (beam_[slot] || targets_[slot].may_meet(to_centre, radius)))
        each_of_slot(slot, [&](uint32_t ray, uint32_t) { visit(ray); });
  }

 private:
  /// Of a part, behind its last ray.
  uint32_t end_of(uint32_t part) const { return uint32_t(uint64_t(count_) * (part + 1) / kParts); }
  /// Calls visit(ray, its number in the slot).
  template <class Visit>
  void each_of_slot(uint32_t slot, const Visit& visit) const {
    uint32_t before = 0;
    for (uint32_t k = 0; k < slot; ++k) before += shares_.eighth[k];
    for (uint32_t part = 0; part < kParts; ++part)
      for (uint32_t k = 0; k < shares_.eighth[slot]; ++k)
        visit(end_of(part) - guided_ + before + k, part * shares_.eighth[slot] + k);
  }
  /// Of a beam's slot.
  uint32_t point_of(uint32_t slot, uint32_t number) const {
    const auto [u, v] = directions_.point(key_, slot + 1, number);
    return Beam::number(u, v);
  }
  uint32_t ray_of_even(uint32_t number) const;
  /// Which guide's ray it is, and its number among those; slot kMaxUsed: evenly spread.
  std::pair<uint32_t, uint32_t> slot_of(uint32_t ray) const;

  const Directions& directions_;
  uint64_t key_;  // the receiver's
  uint32_t count_;
  Vec3f origin_, normal_;
  uint32_t guided_ = 0;  // of each part
  RayShares shares_;
  std::array<Target, kMaxUsed> targets_;
  GuideSquares<kMaxUsed> squares_;            // of the targets
  std::array<const Beam*, kMaxUsed> beam_{};  // of a slot; null: it has a target
};

}  // namespace deltalux::gather
