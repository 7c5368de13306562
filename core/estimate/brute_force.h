// SPDX-License-Identifier: Apache-2.0
// Brute force: every segment against every disc. The oracle of all disc methods.
#pragma once
#include "estimate/estimator.h"

namespace deltalux::estimate {

class BruteForce final : public SignedEstimator {
 public:
  BruteForce(samples::DiscSet discs, segments::SegmentEnd rule)
      : discs_(std::move(discs)), rule_(rule) {}
  Stats accumulate(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                   HitSlots* slots = nullptr) const override;
  const samples::DiscSet& discs() const override { return discs_; }

 private:
  samples::DiscSet discs_;
  segments::SegmentEnd rule_;
};

}  // namespace deltalux::estimate
