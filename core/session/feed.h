// SPDX-License-Identifier: Apache-2.0
// Brings segments to one estimator in portions that suit it.
#pragma once
#include <mutex>
#include <vector>

#include "base/parallel.h"
#include "estimate/estimator.h"
#include "segments/segment_columns.h"

namespace deltalux::session {

inline constexpr size_t kPortion = 65536;  // longer ones gained under 5 % and would delay a cancel

/// Methods that are fast on a few segments get them at once; for the others segments are collected
/// until finish(), then each slab goes to one thread, so that sums need no atomics.
class Feed {
 public:
  Feed(const estimate::SignedEstimator& estimator, const estimate::EnergySums& sums,
       const Workers& workers);

  /// Thread-safe, if no two threads bring the same slab at a time. All segments between two calls
  /// of finish() have one sign. `slots` of collected segments become kMany.
  void add(const segments::SegmentSpan& span, int sign, segments::HitSlots* slots = nullptr);
  /// finish(), if enough is there for a portion. Not thread-safe.
  void settle();
  /// Passes on what was collected. Not thread-safe.
  void finish();

 private:
  void pass_on(const std::vector<uint32_t>& order) const;

  const estimate::SignedEstimator& estimator_;
  estimate::EnergySums sums_;
  const Workers& workers_;
  bool collects_;
  std::mutex mutex_;
  int sign_ = 1;
  segments::SegmentColumns collected_;
};

}  // namespace deltalux::session
