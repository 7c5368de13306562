// SPDX-License-Identifier: Apache-2.0
// How many rays each receiver casts: more where light is noisy, fewer in slits that nothing opens.
#pragma once
#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

namespace deltalux::gather {

/// Rays of many receivers, one after the other.
class RayCounts {
 public:
  static constexpr int kMinDoublings = -2, kMaxDoublings = 3;  ///< doublings of the standard number
  static constexpr uint32_t kFewest = 32;                      ///< halving ends here
  static uint32_t rays(uint32_t standard, int doublings) {
    if (doublings >= 0) return standard << doublings;
    return std::max(standard >> -doublings, std::min(standard, kFewest));
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
  /// Of one receiver.
  uint32_t most() const { return most_; }

 private:
  std::vector<size_t> first_;
  uint32_t most_ = 0;
};

/// What a pilot of a few rays tells about a receiver, all channels together.
struct PilotLook {
  float irradiance;  ///< direct light included
  float variance;    ///< of it, by the rays of the pilot
  float beside = 0;  ///< see Beams::beside
};

/// What decides about numbers of rays; fixed at the bake, in the light of then.
struct RayNeed {
  static constexpr double kMoreRays = 0.5;  ///< of all, at most, where they are needed
  float noise = 0;  ///< relative standard error at which rays double; 0: nowhere
  float dark = 0;   ///< irradiance below which errors count as if it were that
  /// Where a thing that came would be lit so much more brightly than its surroundings, rays double:
  /// its light would come from a small part of what they meet. 0: nowhere.
  float beside = 0;

  RayNeed() = default;
  /// So that at receivers like these at most kMoreRays are cast in addition. A receiver's number
  /// depends on no other receiver then.
  explicit RayNeed(std::span<const PilotLook> pilots, uint32_t standard);
  /// Of a receiver, between `least` and RayCounts::kMaxDoublings.
  int doublings(const PilotLook& pilot, uint32_t standard, int least) const;
  const char* flaw() const;

 private:
  /// Additional rays for each of the standard ones, at receivers like these.
  double more_rays(std::span<const PilotLook> pilots, uint32_t standard) const;
  int doublings_beside(const PilotLook& pilot) const;
  float relative_noise(const PilotLook& pilot, uint32_t standard) const;
};

}  // namespace deltalux::gather
