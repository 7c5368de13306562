// SPDX-License-Identifier: Apache-2.0
// The pilot: every method runs to its full depth on a few of the segments, with its least list
// lengths scaled alike, so that what it counts there grows in proportion to the segments.
#pragma once
#include <memory>

#include "plan/counting.h"

namespace deltalux::plan {

/// What a method will be asked.
struct Load {
  double segments = 0;      ///< in all
  double span = 0;          ///< of them in one call, for the methods that go through all discs
  double outer_radius = 0;  ///< of the sphere cache's S_0; 0 = around the sample

  double calls() const { return segments > span ? segments / span : 1.0; }
  double per_call() const { return segments / calls(); }
};

/// One segment of so many is enough; where these are fewer than kMinPilot, more are taken.
inline constexpr double kPilotDivisor = 100;
inline constexpr double kMinPilot = 4096;

/// Counts of the methods on one set of discs.
class Pilot {
 public:
  Pilot(samples::DiscSet discs, segments::SegmentEnd rule, const Workers& workers)
      : discs_(std::move(discs)), rule_(rule), workers_(workers) {}

  const samples::DiscSet& discs() const { return index_ ? index_->discs() : discs_; }
  /// Estimated counts of `method` under `load`, from `sample`, segments of that load. Those of
  /// brute force follow without a run, but for its hits, which it leaves out. Throws Cancelled.
  Counts count(Method method, const SegmentSample& sample, const Load& load,
               Progress* progress = nullptr);
  /// What `method` does at least: no pilot runs.
  Counts least(Method method, const Load& load) const;
  /// An estimator on the discs, which leave the pilot; an index that the pilot built is reused.
  std::unique_ptr<estimate::SignedEstimator> release(Method method, Progress* progress = nullptr);

 private:
  samples::DiscSet discs_;
  segments::SegmentEnd rule_;
  const Workers& workers_;
  std::unique_ptr<estimate::DiscIndex> index_;  ///< holds the discs once it is there
};

}  // namespace deltalux::plan
