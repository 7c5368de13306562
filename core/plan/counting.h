// SPDX-License-Identifier: Apache-2.0
// One search by one method, with everything counted that takes time.
#pragma once
#include <vector>

#include "base/vec.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/sphere_cache/sphere_cache.h"
#include "plan/cost_model.h"
#include "segments/segment_columns.h"

namespace deltalux::plan {

/// Segments that stand for more of their kind, as arrays; all carry one quantum.
class SegmentSample {
 public:
  void add(Vec3f origin, Vec3f direction, float length, float extended);
  size_t count() const { return columns_.count(); }
  /// All of them so often.
  SegmentSample repeated(size_t times) const;
  segments::SegmentSpan span() const { return columns_.span(); }
  /// At most `count` of them, evenly spaced along a curve through their middles: their counts have
  /// a quarter of the error of as many taken at random.
  SegmentSample thinned(size_t count) const;

 private:
  segments::SegmentColumns columns_;
};

/// Sums that nobody reads, as large as those of a session.
class ScratchSums {
 public:
  explicit ScratchSums(const samples::DiscSet& discs);
  estimate::EnergySums sums() { return {data_.data(), data_.size() / 3, false}; }

 private:
  std::vector<int64_t> data_;
};

/// Share of the discs that face elsewhere than the one before them.
double turned_share(const samples::DiscSet& discs);

/// Of a sphere cache, but for its visits, where the segments are a `share` of those of a call.
Counts counts_of(const estimate::Stats& stats, const estimate::SphereLevels& levels,
                 size_t segments, double share);

/// In portions like those of a session.
Counts search(const estimate::DiscIndex& index, const segments::SegmentSpan& segments,
              ScratchSums& sums);
/// The segments are a `share` of those of a call, whose far counts these are. Counts do not depend
/// on `workers`. Throws Cancelled.
Counts search(const estimate::SphereCache& cache, const segments::SegmentSpan& segments,
              double share, ScratchSums& sums, const Workers& workers,
              Progress* progress = nullptr);
/// By a new ray map. Throws Cancelled.
Counts search_ray_map(const samples::DiscSet& discs, segments::SegmentEnd rule, uint32_t leaf_size,
                      const segments::SegmentSpan& segments, ScratchSums& sums,
                      Progress* progress = nullptr);
Counts search_brute_force(const samples::DiscSet& discs, segments::SegmentEnd rule,
                          const segments::SegmentSpan& segments, ScratchSums& sums);

}  // namespace deltalux::plan
