#pragma once
#include "estimate/estimator.h"
#include "estimate/disc_tree_build.h"
#include "base/parallel.h"
#include "base/progress.h"
namespace deltalux::estimate {
class DiscIndex final : public SignedEstimator {
 public:
  DiscIndex(samples::DiscSet discs, segments::SegmentEnd rule, const Workers& workers, Progress* progress = nullptr);
  Stats accumulate(const segments::SegmentSpan&, int sign, const EnergySums&, HitSlots* slots = nullptr) const override;
  const samples::DiscSet& discs() const override { return discs_; }
  size_t bytes() const { return tree_.nodes.size() * 256 + tree_.leaves.size() * 256; }
 private:
  samples::DiscSet discs_; segments::SegmentEnd rule_; DiscTree tree_;
};
}
