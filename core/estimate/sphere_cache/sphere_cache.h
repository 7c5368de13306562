// SPDX-License-Identifier: Apache-2.0
// Sphere cache (paper 2.3): samples are visited along a curve, each looks for its segments in the
// innermost of nested spheres around it whose lists were cut from one another.
#pragma once
#include <vector>

#include "estimate/estimator.h"
#include "estimate/sphere_cache/chain.h"
#include "estimate/sphere_cache/list.h"
#include "samples/curve_order.h"

namespace deltalux::estimate {

using sphere_cache::Containment;

struct SphereCacheOptions {
  segments::SegmentEnd rule = segments::SegmentEnd::bounded;
  double ratio = 2.0 / 3;   ///< Q, of the radii of consecutive spheres
  uint64_t min_rays = 100;  ///< shorter lists are not subdivided
  samples::Curve order = samples::Curve::hilbert;
  Containment containment = Containment::all;
  double outer_radius = 0;  ///< of S_0; 0 = around all segments of a call
  uint32_t max_levels = 0;  ///< below S_0; 0 = as many as the discs ask for
  bool deposits = true;     ///< false: lists are built and counted, no disc is tested
  /// Below 1 the segments stand for more of their kind: lists are divided where all of these would
  /// be `min_rays`. Lists too short to tell are judged by those around them: that of S_i has
  /// `shrink[i]` times the segments of the one around it (where it is not given: Q² times).
  double share = 1;
  std::vector<double> shrink = {};
  sphere_cache::Lanes lanes = sphere_cache::Lanes::widest;
};

/// Per level, S_0 first. S_0 holds all segments and is never invalid nor rebuilt.
struct SphereLevels {
  std::vector<double> radius;
  std::vector<uint64_t> rebuilds;      ///< times that S_i was built, the first included
  std::vector<uint64_t> first_misses;  ///< samples whose outermost invalid sphere was S_i
  std::vector<uint64_t> rays;          ///< segments in S_i, summed over its builds
  std::vector<uint64_t> tests;         ///< of segments against S_i; their sum is all sphere tests
};

/// Radius of the S_0 that a cache puts around these segments, for discs of up to `max_radius`.
double enclosing_radius(const segments::SegmentSpan& segments, segments::SegmentEnd rule,
                        float max_radius, Progress* progress = nullptr);

/// Finds for each disc all segments that cross it: under `all` and `nested` the same ones as
/// BruteForce to the bit, under `literal` (lossy) fewer. 32 bytes per segment, and for
/// each thread 32 Q^2 / (1 - Q^2) + 4 where segments are spread evenly.
class SphereCache final : public SignedEstimator {
 public:
  /// Throws OptionError for a ratio that is not between 0 and 1, and discs that are not finite.
  /// Throws Cancelled.
  SphereCache(samples::DiscSet discs, const SphereCacheOptions& options,
              const Progress* progress = nullptr);

  /// One chain of spheres for the span, in the caller's thread. Fast for long spans only.
  Stats accumulate(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                   HitSlots* slots = nullptr) const override;
  const samples::DiscSet& discs() const override { return discs_; }
  size_t best_span() const override;

  struct Result {
    Stats stats;
    SphereLevels levels;
  };
  /// The same by several threads, each on a run of samples, so that `sums` need not be shared if no
  /// two discs feed one sample. The statistics are those of one chain through all samples, for any
  /// number of workers. `nested` and `literal` use one worker: their spheres depend on the lists
  /// before. Throws Cancelled, and OptionError where the ratio would need too many spheres.
  Result accumulate_levels(const segments::SegmentSpan& segments, int sign, const EnergySums& sums,
                           const Workers& workers, Progress* progress = nullptr) const;

 private:
  samples::DiscSet discs_;
  SphereCacheOptions options_;
  std::vector<uint32_t> order_;  ///< of visits
};

}  // namespace deltalux::estimate
