// SPDX-License-Identifier: Apache-2.0
// Disc queries of a ray map: which segments cross which discs, with the same result as brute force.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "estimate/estimator.h"
#include "estimate/ray_map/ray_map.h"

namespace deltalux::estimate {

struct RayMapHit {
  uint32_t segment, disc;
  Vec3f offset;  ///< of the crossing, relative to the disc's centre
};

/// Calls `take` with the crossings of segments and discs, each once, in portions, possibly from
/// several threads at a time. With a follower, only with crossings of segments that it has not
/// seen.
RayMapStats find_crossings(RayMap& map, const samples::DiscSet& discs, const Workers& workers,
                           const std::function<void(std::span<const RayMapHit>)>& take,
                           Progress* progress = nullptr, uint32_t follower = 0);

/// Builds a map over each span, and queries it with all discs.
class RayMapDiscs final : public SignedEstimator {
 public:
  RayMapDiscs(samples::DiscSet discs, segments::SegmentEnd rule)
      : discs_(std::move(discs)), rule_(rule) {}
  /// Stats count tests of segments against halves of cells (node_tests) and against discs.
  Stats accumulate(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                   HitSlots* slots = nullptr) const override;
  const samples::DiscSet& discs() const override { return discs_; }
  /// Large, since all discs traverse the map of each span.
  size_t best_span() const override { return size_t(1) << 20; }

 private:
  samples::DiscSet discs_;
  segments::SegmentEnd rule_;
};

}  // namespace deltalux::estimate
