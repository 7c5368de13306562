// SPDX-License-Identifier: Apache-2.0
// Runs one search by one method and counts everything that takes time.
#pragma once
#include <vector>

#include "base/vec.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/sphere_cache/sphere_cache.h"
#include "plan/cost_model.h"
#include "segments/segment_columns.h"

namespace deltalux::plan {

/// A representative sample of segments, as a structure of arrays; all carry one quantum.
class SegmentSample {
 public:
  void add(Vec3f origin, Vec3f direction, float length, float extended);
  size_t count() const { return columns_.count(); }
  /// All segments, repeated `times` times.
  SegmentSample repeated(size_t times) const;
  segments::SegmentSpan span() const { return columns_.span(); }
  /// At most `count` of the segments, evenly spaced along a curve through their midpoints: the
  /// error of their counts is a quarter of that of random ones.
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

/// Share of the discs whose normals differ from that of the disc before.
double turned_share(const samples::DiscSet& discs);

/// Counts of a sphere cache except visits; the segments are a `share` of those of a call.
Counts counts_of(const estimate::Stats& stats, const estimate::SphereLevels& levels,
                 size_t segments, double share);

/// Searches in portions of the size that a session uses.
Counts search(const estimate::DiscIndex& index, const segments::SegmentSpan& segments,
              ScratchSums& sums);
/// The segments are a `share` of those of a call; counts of far tests and hits are those of the
/// whole call. Counts do not depend on `workers`. Throws Cancelled.
Counts search(const estimate::SphereCache& cache, const segments::SegmentSpan& segments,
              double share, ScratchSums& sums, const Workers& workers,
              Progress* progress = nullptr);
/// Builds a new ray map. Throws Cancelled.
Counts search_ray_map(const samples::DiscSet& discs, segments::SegmentEnd rule, uint32_t leaf_size,
                      const segments::SegmentSpan& segments, ScratchSums& sums,
                      Progress* progress = nullptr);
Counts search_brute_force(const samples::DiscSet& discs, segments::SegmentEnd rule,
                          const segments::SegmentSpan& segments, ScratchSums& sums);

}  // namespace deltalux::plan
