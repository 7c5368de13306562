// SPDX-License-Identifier: Apache-2.0
// Disc index (paper 2.4): discs are in a bounding volume hierarchy, which every segment traverses.
#pragma once
#include "estimate/disc_index/tree.h"
#include "estimate/estimator.h"

namespace deltalux::estimate {

/// Finds all discs that each segment crosses, exactly the same ones as BruteForce. Needs about 50
/// bytes per disc in addition to the DiscSet.
class DiscIndex final : public SignedEstimator {
 public:
  /// Builds the hierarchy. Throws Cancelled, and OptionError for discs that are not finite.
  DiscIndex(samples::DiscSet discs, segments::SegmentEnd rule, const Workers& workers,
            Progress* progress = nullptr);
  /// Most efficient for spans of several hundred segments and more. Stats count visited nodes, and
  /// eight disc tests per visited leaf.
  Stats accumulate(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                   HitSlots* slots = nullptr) const override;
  const samples::DiscSet& discs() const override { return discs_; }
  size_t bytes() const override;

 private:
  samples::DiscSet discs_;
  segments::SegmentEnd rule_;
  DiscTree tree_;
};

}  // namespace deltalux::estimate
