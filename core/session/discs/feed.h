// SPDX-License-Identifier: Apache-2.0
// Passes segments to one estimator in portions of a size at which it is efficient.
#pragma once
#include <mutex>
#include <vector>

#include "base/parallel.h"
#include "estimate/estimator.h"
#include "segments/segment_columns.h"

namespace deltalux::session {

// Longer portions gained less than 5 % and would delay cancellation.
inline constexpr size_t kPortion = 65536;

/// Estimators that are efficient with short spans get their segments at once. For the others,
/// segments are collected until finish(), which gives each slab to one thread, so that sums need no
/// atomics.
class Feed {
 public:
  Feed(const estimate::SignedEstimator& estimator, const estimate::EnergySums& sums,
       const Workers& workers);

  /// Adds (sign +1) or removes (-1) segments. Thread-safe as long as no two threads pass segments
  /// of the same slab at a time. All segments between two calls of finish() must have one sign.
  /// Where segments are collected, the discs that they cross are not known yet: their `slots`
  /// become kMany.
  void add(const segments::SegmentSpan& span, int sign, segments::HitSlots* slots = nullptr);
  /// Calls finish() if a full portion has been collected. Not thread-safe.
  void settle();
  /// Passes all collected segments to the estimator. Not thread-safe.
  void finish();

 private:
  void pass_on(const std::vector<uint32_t>& order) const;

  const estimate::SignedEstimator& estimator_;
  estimate::EnergySums sums_;
  const Workers& workers_;
  /// Whether segments are collected until finish().
  bool collects_;
  std::mutex mutex_;
  int sign_ = 1;
  segments::SegmentColumns collected_;
};

}  // namespace deltalux::session
