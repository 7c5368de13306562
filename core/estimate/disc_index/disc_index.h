// SPDX-License-Identifier: Apache-2.0
// Disc indexing (paper 2.4): the discs stand in a hierarchy of boxes, every segment visits it.
#pragma once
#include "estimate/disc_index/tree.h"
#include "estimate/estimator.h"

namespace deltalux::estimate {

/// Finds for each segment all discs it crosses, the same ones as BruteForce to the bit.
/// About 50 bytes per disc beside the DiscSet.
class DiscIndex final : public SignedEstimator {
 public:
  /// Builds the hierarchy. Throws Cancelled, and OptionError for discs that are not finite.
  DiscIndex(samples::DiscSet discs, segments::SegmentEnd rule, const Workers& workers,
            Progress* progress = nullptr);
  /// Fastest for spans of some hundred segments and more. Stats count visited nodes, and eight
  /// disc tests per visited leaf.
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
