// SPDX-License-Identifier: Apache-2.0
// One walk along the samples with one chain of ray lists.
#pragma once
#include <vector>

#include "estimate/sphere_cache/sphere_cache.h"

namespace deltalux::estimate::sphere_cache {

/// What all runs of a call share.
struct Root {
  SegmentList list;              ///< of S_0
  std::vector<uint32_t> strays;  ///< segments that no list can hold: every disc tests them
  std::vector<double> radius;    ///< of S_0, S_1, ...
  double margin = 0;             ///< bound of the rounding in the tests of segments, metres
};

Root make_root(const segments::SegmentSpan& segments, const SphereCacheOptions& options,
               const samples::DiscSet& discs, Progress* progress);

/// Where the segments' power goes.
struct Target {
  const segments::SegmentSpan& segments;
  int sign;
  const EnergySums& sums;
  HitSlots* slots;
};

class Run {
 public:
  /// `chain` is the state that the samples before the run's first have left.
  Run(const samples::DiscSet& discs, const SphereCacheOptions& options, const Root& root,
      const Target& target, const SphereChain& chain);
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
  /// Lists of S_1 to S_built_. Under `all` the chain is known to its full depth, whether or not
  /// lists are long enough to be divided, so that it can be followed without them.
  std::vector<SegmentList> lists_;
  std::vector<double> expected_;  ///< lengths of the lists, less their noise; of a pilot only
  int built_ = 0;
  std::vector<uint32_t> scratch_;
};

}  // namespace deltalux::estimate::sphere_cache
