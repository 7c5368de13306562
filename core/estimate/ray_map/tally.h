// SPDX-License-Identifier: Apache-2.0
// Sums of a set of discs that follow the changes of a ray map.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "estimate/ray_map/discs.h"

namespace deltalux::estimate {

/// Remembers which discs each segment crossed, so that its removal needs no search. Needs four
/// bytes per segment and eight per crossing.
class RayMapTally {
 public:
  /// `name`: a number other than 0 that no other follower of the map has.
  RayMapTally(samples::DiscSet discs, uint32_t name)
      : discs_(std::move(discs)), name_(name), sums_(3 * discs_.size()) {}

  /// Adds the segments that were added to the map since the last call, or all of them after the
  /// tree restarted. `power` holds 3 quanta per id. The sums then equal those of a new map. Throws
  /// Cancelled; the next call then recomputes everything.
  RayMapStats refresh(RayMap& map, std::span<const uint32_t> power, const Workers& workers,
                      Progress* progress = nullptr);
  /// Subtracts segments from the sums; call it before RayMap::remove().
  void remove(std::span<const uint32_t> ids, std::span<const uint32_t> power);

  const std::vector<int64_t>& sums() const { return sums_; }
  uint64_t hits() const { return hits_; }
  uint32_t name() const { return name_; }
  size_t bytes() const {
    return first_.size() * sizeof(uint32_t) + crossings_.size() * sizeof(Crossed);
  }

 private:
  static constexpr uint32_t kNone = 0xffffffffu;
  struct Crossed {
    uint32_t disc, next;
  };
  void forget();

  samples::DiscSet discs_;
  uint32_t name_, generation_ = 0;
  bool valid_ = false;
  std::vector<int64_t> sums_;
  std::vector<uint32_t> first_;  ///< by segment: index of its first crossing
  std::vector<Crossed> crossings_;
  uint32_t free_ = kNone;
  uint64_t hits_ = 0;
};

}  // namespace deltalux::estimate
