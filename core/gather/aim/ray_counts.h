// SPDX-License-Identifier: Apache-2.0
// Decides how many rays each receiver casts: more where light is noisy, fewer in slits that no edit
// can open.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace deltalux::gather {

/// The numbers of rays of many receivers, and the index of each one's first ray.
class RayCounts {
 public:
  /// Limits of log2 of the factor on the standard number of rays.
  static constexpr int kMinDoublings = -2, kMaxDoublings = 3;
  static constexpr uint32_t kMinRays = 32;  ///< fewer rays than this are not halved further
  /// Number of rays after doubling (or halving) the standard number.
  static uint32_t rays(uint32_t standard, int doublings) {
    if (doublings >= 0) return standard << doublings;
    return std::max(standard >> -doublings, std::min(standard, kMinRays));
  }

  RayCounts() : RayCounts(std::span<const int8_t>{}, 0) {}
  RayCounts(std::span<const int8_t> doublings, uint32_t standard) : first_{0} {
    first_.reserve(doublings.size() + 1);
    for (int8_t own : doublings) first_.push_back(first_.back() + rays(standard, own));
    for (size_t i = 0; i < receivers(); ++i) most_ = std::max(most_, count(i));
  }
  size_t receivers() const { return first_.size() - 1; }
  size_t first(size_t receiver) const { return first_[receiver]; }
  uint32_t count(size_t receiver) const {
    return uint32_t(first_[receiver + 1] - first_[receiver]);
  }
  size_t all() const { return first_.back(); }
  /// The largest number of rays of one receiver.
  uint32_t most() const { return most_; }

 private:
  std::vector<size_t> first_;
  uint32_t most_ = 0;
};

/// What a few pilot rays tell about a receiver, sum of all channels.
struct PilotEstimate {
  float irradiance;  ///< including direct light
  float variance;    ///< of the mean over the pilot rays
  float beside = 0;  ///< see Beams::beside
};

/// The rule for numbers of rays; fixed at the bake, in the light of that state.
struct RayNeed {
  static constexpr double kMoreRays = 0.5;  ///< additional rays, at most this share of all
  float noise = 0;  ///< relative standard error from which rays double; 0: nowhere
  float dark = 0;   ///< lower irradiances count as this one when errors are made relative
  /// Rays double where an object, if placed there, would be lit more strongly than its surroundings
  /// by this factor: its light would come from a small part of what the rays meet. 0: nowhere.
  float beside = 0;

  RayNeed() = default;
  /// Chooses limits with which receivers like these cast at most kMoreRays additional rays. A
  /// receiver's number then depends on no other receiver.
  explicit RayNeed(std::span<const PilotEstimate> pilots, uint32_t standard);
  /// log2 of the factor for a receiver, between `least` and RayCounts::kMaxDoublings.
  int doublings(const PilotEstimate& pilot, uint32_t standard, int least) const;
  /// Why these data are invalid; null if they are valid.
  const char* flaw() const;

 private:
  /// Additional rays per standard ray, for receivers like these.
  double more_rays(std::span<const PilotEstimate> pilots, uint32_t standard) const;
  int doublings_beside(const PilotEstimate& pilot) const;
  float relative_noise(const PilotEstimate& pilot, uint32_t standard) const;
};

}  // namespace deltalux::gather
