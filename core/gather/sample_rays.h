// SPDX-License-Identifier: Apache-2.0
// The rays of one sample: most spread evenly, some towards guides, and what each weighs.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "base/archive.h"
#include "direct/light_shape.h"
#include "gather/directions.h"
#include "gather/guide.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

inline constexpr uint32_t kParts = 8;     // of the rays, each an estimate by itself
inline constexpr uint32_t kMostUsed = 4;  // guides of one sample

/// How many of a sample's rays go towards guides. In eighths: each part of the rays has the same
/// share of them.
struct RayShares {
  std::array<uint16_t, kMostUsed> guide{}, eighth{};
  /// In one part of the rays.
  uint32_t guided() const {
    uint32_t sum = 0;
    for (uint16_t own : eighth) sum += own;
    return sum;
  }
};

/// Chosen once, at the bake; without guides both are empty.
struct Guiding {
  std::vector<Guide> guides;
  std::vector<RayShares> shares;  ///< per sample
  size_t bytes() const {
    return guides.capacity() * sizeof(Guide) + shares.capacity() * sizeof(RayShares);
  }
  /// Arrays named "gather.…".
  void save(ArchiveView& archive) const;
  /// Throws FormatError: then this object is of no use.
  void restore(ArchiveSource& archive, size_t samples, uint32_t rays);
};

/// Shares of a receiver that is about to cast `rays`, by what of the guides it sees now.
RayShares share_rays(std::span<const Guide> guides, const direct::Receiver& receiver, uint32_t rays,
                     const trace::RayCaster& caster, uint64_t seed);

class SampleRays {
 public:
  SampleRays(const Directions& directions, const Guiding& guiding, uint32_t sample,
             const direct::Receiver& receiver);
  Vec3f origin() const { return origin_; }
  /// Unit; zero where the ray would begin below the surface.
  Vec3f direction(uint32_t ray) const;
  /// What the light along the ray counts times; 1 without guides. The balance heuristic of
  /// multiple importance sampling (Veach & Guibas 1995).
  float weight(uint32_t ray) const;

  /// Calls visit(ray) for all rays that may meet the ball, and for few others.
  template <class Visit>
  void each_towards(Vec3f centre, float radius, const Visit& visit) const {
    const Vec3f to_centre = centre - origin_;
    const uint32_t even = directions_.count() - kParts * guided_;
    directions_.each_towards(key_, normal_, to_centre, radius, [&](uint32_t number) {
      if (number < even) visit(ray_of_even(number));
    });
    uint32_t before = 0;
    for (uint32_t slot = 0; slot < kMostUsed; before += shares_.eighth[slot++]) {
      if (!shares_.eighth[slot] || !targets_[slot].may_meet(to_centre, radius)) continue;
      for (uint32_t part = 0; part < kParts; ++part)
        for (uint32_t k = 0; k < shares_.eighth[slot]; ++k)
          visit(end_of(part) - guided_ + before + k);
    }
  }

 private:
  /// Of a part, behind its last ray.
  uint32_t end_of(uint32_t part) const {
    return uint32_t(uint64_t(directions_.count()) * (part + 1) / kParts);
  }
  uint32_t ray_of_even(uint32_t number) const;
  /// Which guide's ray it is, and its number among those; slot kMostUsed: evenly spread.
  std::pair<uint32_t, uint32_t> slot_of(uint32_t ray) const;

  const Directions& directions_;
  uint64_t key_;  // the receiver's
  Vec3f origin_, normal_;
  uint32_t guided_ = 0;  // of each part
  RayShares shares_;
  std::array<Target, kMostUsed> targets_;
};

}  // namespace deltalux::gather
