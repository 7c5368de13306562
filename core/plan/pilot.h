// SPDX-License-Identifier: Apache-2.0
// The pilot: runs every method to its full depth on a few segments, with thresholds on list lengths
// scaled in proportion, so that counts grow in proportion to the number of segments.
#pragma once
#include <memory>

#include "plan/counting.h"

namespace deltalux::plan {

/// The work that a method will have to do.
struct Load {
  double segments = 0;  ///< total
  double span = 0;      ///< segments per call, for the methods that visit all discs in every call
  double outer_radius = 0;  ///< of the sphere cache's S_0; 0 = enclose the sample

  double calls() const { return segments > span ? segments / span : 1.0; }
  double per_call() const { return segments / calls(); }
};

/// One segment in this many is enough; at least kMinPilot segments are used, if there are as
/// many.
inline constexpr double kPilotDivisor = 100;
inline constexpr double kMinPilot = 4096;

/// Predicts the counts of methods on one set of discs.
class Pilot {
 public:
  Pilot(samples::DiscSet discs, segments::SegmentEnd rule, const Workers& workers)
      : discs_(std::move(discs)), rule_(rule), workers_(workers) {}

  const samples::DiscSet& discs() const { return index_ ? index_->discs() : discs_; }
  /// Estimated counts of `method` under `load`, from `sample`, a sample of the segments of that
  /// load. Counts of brute force are computed without a run, except for its hits, which are left
  /// out. Throws Cancelled.
  Counts count(Method method, const SegmentSample& sample, const Load& load,
               Progress* progress = nullptr);
  /// A lower bound of the counts of `method`, without a run.
  Counts least(Method method, const Load& load) const;
  /// Moves the discs into an estimator; reuses the index if the pilot has built one.
  std::unique_ptr<estimate::SignedEstimator> release(Method method, Progress* progress = nullptr);

 private:
  samples::DiscSet discs_;
  segments::SegmentEnd rule_;
  const Workers& workers_;
  std::unique_ptr<estimate::DiscIndex> index_;  ///< holds the discs once it is built
};

}  // namespace deltalux::plan
