// SPDX-License-Identifier: Apache-2.0
// Sphere cache (paper 2.3): visits samples along a curve; each searches its segments in the
// innermost of nested spheres around it, whose lists of segments are subsets of one another.
#pragma once
#include <vector>

#include "base/curve_order.h"
#include "estimate/estimator.h"
#include "estimate/sphere_cache/chain.h"
#include "estimate/sphere_cache/list.h"

namespace deltalux::estimate {

using sphere_cache::Containment;

struct SphereCacheOptions {
  segments::SegmentEnd rule = segments::SegmentEnd::bounded;
  double ratio = 2.0 / 3;   ///< Q: ratio of the radii of consecutive spheres
  uint64_t min_rays = 100;  ///< lists with fewer segments are not subdivided
  Curve order = Curve::hilbert;
  Containment containment = Containment::all;
  double outer_radius = 0;  ///< of S_0; 0 = enclose all segments of a call
  uint32_t max_levels = 0;  ///< number of spheres below S_0; 0 = down to the size of the discs
  bool deposits = true;     ///< false: build and count lists without testing discs
  /// Below 1, the segments are a sample of this share of all: lists are subdivided where the
  /// complete lists would have `min_rays`. The length of a list too short to be representative is
  /// extrapolated from the list around it: S_i has `shrink[i]` times as many segments as the sphere
  /// around it (Q² times if not given).
  double share = 1;
  std::vector<double> shrink = {};
  sphere_cache::Lanes lanes = sphere_cache::Lanes::widest;
};

/// Statistics by level, S_0 first. S_0 contains all segments, and is never invalid nor rebuilt.
struct SphereLevels {
  std::vector<double> radius;
  std::vector<uint64_t> rebuilds;      ///< how often S_i was built, including the first time
  std::vector<uint64_t> first_misses;  ///< samples whose outermost invalid sphere was S_i
  std::vector<uint64_t> rays;          ///< number of segments in S_i, summed over its builds
  /// tests of segments against S_i; the sum over levels is the number of all sphere tests
  std::vector<uint64_t> tests;
};

/// Radius of the S_0 that a cache uses for these segments and discs of radius up to `max_radius`.
double enclosing_radius(const segments::SegmentSpan& segments, segments::SegmentEnd rule,
                        float max_radius, Progress* progress = nullptr);

/// Finds all segments that cross each disc: under `all` and `nested` exactly the same ones as
/// BruteForce; under `literal` (lossy) fewer. Needs 32 bytes per segment, and for each thread 32
/// Q^2 / (1 - Q^2) + 4 bytes if segments are evenly distributed.
class SphereCache final : public SignedEstimator {
 public:
  /// Throws OptionError for a ratio that is not between 0 and 1, and discs that are not finite.
  /// Throws Cancelled.
  SphereCache(samples::DiscSet discs, const SphereCacheOptions& options,
              const Progress* progress = nullptr);

  /// Uses one chain of spheres for the span, in the caller's thread. Efficient for long spans only.
  Stats accumulate(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                   HitSlots* slots = nullptr) const override;
  const samples::DiscSet& discs() const override { return discs_; }
  size_t best_span() const override;

  struct Result {
    Stats stats;
    SphereLevels levels;
  };
  /// The same with several threads, each for a run of samples; so `sums` need not be shared if no
  /// two discs add to one sample. The statistics are those of one chain through all samples, for
  /// any number of workers. `nested` and `literal` use one worker, since their spheres depend on
  /// the lists before. Throws Cancelled, and OptionError if the ratio would need too many spheres.
  Result accumulate_levels(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                           const Workers& workers, Progress* progress = nullptr) const;

 private:
  samples::DiscSet discs_;
  SphereCacheOptions options_;
  std::vector<uint32_t> order_;  ///< of visits
};

}  // namespace deltalux::estimate
