// SPDX-License-Identifier: Apache-2.0
// One pass over samples with one chain of lists of segments.
#pragma once
#include <vector>

#include "estimate/sphere_cache/sphere_cache.h"

namespace deltalux::estimate::sphere_cache {

/// Data that all runs of a call share.
struct Root {
  SegmentList list;  ///< segments of S_0
  /// segments that no list can hold: they are tested against every disc
  std::vector<uint32_t> strays;
  std::vector<double> radius;  ///< of S_0, S_1, ...
  double margin = 0;           ///< bound of the rounding errors in tests of segments, in metres
};

Root make_root(const segments::SegmentSpan& segments, const SphereCacheOptions& options,
               const samples::DiscSet& discs, Progress* progress);

/// Where the power of segments is added.
struct Target {
  const segments::SegmentSpan& segments;
  int sign;
  const EnergySums& sums;
  HitSlots* slots;
};

/// A pass over consecutive samples.
class Run {
 public:
  /// `chain`: the state left by the samples before the run's first one.
  Run(const samples::DiscSet& discs, const SphereCacheOptions& options, const Root& root,
      const Target& target, const SphereChain& chain);
  /// Visits the next sample's disc.
  void visit(uint32_t disc);

  Stats stats;
  SphereLevels levels;  ///< without `radius`

 private:
  const SegmentList& list(int level) const {
    return level == 0 ? root_.list : lists_[size_t(level)];
  }
  bool worth_dividing(int level) const {
    if (options_.share == 1) return list(level).count >= options_.min_rays;
    return expected_[size_t(level)] >= double(options_.min_rays) * options_.share;
  }
  void expect(int level);
  void build_to(int level, bool counted);
  void deposit(const SegmentList& list, uint32_t disc);
  void add(uint32_t disc, uint32_t segment, Vec3f offset);

  const samples::DiscSet& discs_;
  const SphereCacheOptions& options_;
  const Root& root_;
  const Target& target_;
  const Kernels kernels_;
  float max_radius_ = 0;
  SphereChain chain_;
  /// Lists of S_1 to S_built_. Under Containment::all, the chain is maintained to its full depth,
  /// whether or not lists are long enough to be subdivided, so that it can be computed without
  /// lists.
  std::vector<SegmentList> lists_;
  std::vector<double> expected_;  ///< lengths of the lists, smoothed; only used with share < 1
  int built_ = 0;
  std::vector<uint32_t> scratch_;
};

}  // namespace deltalux::estimate::sphere_cache
