// SPDX-License-Identifier: Apache-2.0
// Patch accumulation (Arvo 1986; Pattanaik & Mudur 1992): the power that lands on each triangle.
#pragma once
#include <memory>

#include "estimate/estimator.h"
#include "estimate/surface_tree.h"

namespace deltalux::estimate {

/// Adds and removes like a SignedEstimator, but segments land on patches, not on discs.
class PatchSum {
 public:
  /// Patches are the triangles of `patches`.
  explicit PatchSum(std::shared_ptr<const SurfaceTree> patches) : patches_(std::move(patches)) {}

  /// Adds (sign +1) or removes (-1) each segment's power to the sums (3 per patch) of the patch on
  /// whose front it ends. Exact, independent of the order and of the workers. Throws Cancelled
  /// before anything was added.
  Stats accumulate(const segments::SegmentSpan& segments, int sign, int64_t* sums,
                   const Workers& workers, Progress& progress) const;
  const SurfaceTree& patches() const { return *patches_; }

 private:
  std::shared_ptr<const SurfaceTree> patches_;
};

}  // namespace deltalux::estimate
