// SPDX-License-Identifier: Apache-2.0
// Sums of one set of discs that follow the changes of a ray map.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "estimate/ray_map/discs.h"

namespace deltalux::estimate {

/// Remembers which discs each segment crossed, so that its removal needs no search. Four bytes per
/// segment and eight per crossing.
class RayMapTally {
 public:
  /// `name`: a number that no other follower of the map has, not 0.
  RayMapTally(samples::DiscSet discs, uint32_t name)
      : discs_(std::move(discs)), name_(name), sums_(3 * discs_.size()) {}

  /// Adds the segments that came since the last call; all of them after the tree started anew.
  /// `power` holds 3 quanta per id. The sums then equal those of a new map. Throws Cancelled; the
  /// next call then starts from nothing.
  RayMapStats refresh(RayMap& map, std::span<const uint32_t> power, const Workers& workers,
                      Progress* progress = nullptr);
  /// Takes segments out of the sums; to be called before RayMap::remove().
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
  std::vector<uint32_t> first_;  ///< by segment: its first crossing
  std::vector<Crossed> crossings_;
  uint32_t free_ = kNone;
  uint64_t hits_ = 0;
};

}  // namespace deltalux::estimate
