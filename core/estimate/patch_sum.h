// SPDX-License-Identifier: Apache-2.0
// Patch accumulation (Arvo 1986; Pattanaik & Mudur 1992): sums the power that lands on each
// triangle.
#pragma once
#include <memory>

#include "estimate/estimator.h"
#include "estimate/surface_tree.h"

namespace deltalux::estimate {

/// Adds and removes segments like a SignedEstimator, but to patches instead of discs.
class PatchSum {
 public:
  /// Patches are the triangles of `patches`.
  explicit PatchSum(std::shared_ptr<const SurfaceTree> patches) : patches_(std::move(patches)) {}

  /// Adds (sign +1) or removes (-1) the power of each segment to the sums (3 per patch) of the
  /// patch on whose front side it ends. Exact; independent of the order and of the number of
  /// workers. Throws Cancelled before anything is added.
  Stats accumulate(const segments::SegmentSpan& segments, int sign, int64_t* sums,
                   const Workers& workers, Progress& progress) const;
  const SurfaceTree& patches() const { return *patches_; }

 private:
  std::shared_ptr<const SurfaceTree> patches_;
};

}  // namespace deltalux::estimate
