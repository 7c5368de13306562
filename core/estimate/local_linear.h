// SPDX-License-Identifier: Apache-2.0
// Local-linear density estimation on surfaces (Walter, Hubbard, Shirley & Greenberg 1997): fits a
// plane to the hits around a sample, with a kernel clipped to the surface.
#pragma once
#include <memory>

#include "estimate/estimator.h"
#include "estimate/surface_tree.h"

namespace deltalux::estimate {

class LocalLinear final : public GatherEstimator {
 public:
  enum class Kernel : uint8_t { constant, epanechnikov };
  struct Options {
    Kernel kernel = Kernel::epanechnikov;
    double bandwidth = 0;  ///< radius of the kernel in metres; 0 = from the surface's hits
    /// For that: the number of hits in a full disc, averaged over the surface.
    double expected_hits = 100;
  };

  /// A sample belongs to the surface of the nearest triangle that faces in its direction.
  LocalLinear(std::vector<Vec3d> points, std::vector<Vec3d> normals, const Options& options,
              std::shared_ptr<const SurfaceTree> surfaces);

  /// Reproduces constant and linear irradiance on a surface without bias, up to its border.
  /// Negative estimates become 0. Independent of the order of segments. Throws Cancelled.
  Gathered estimate(const segments::SegmentSpan& segments, const Workers& workers,
                    Progress* progress = nullptr) const override;
  /// The kernel's radius on each surface, given the number of hits on each; 0 where there are none.
  std::vector<double> bandwidths(const std::vector<uint64_t>& hits) const;

 private:
  struct Hit;
  struct Cell;
  class Grid;
  void estimate_one(size_t sample, const Grid& grid, uint32_t surface, double bandwidth,
                    std::vector<uint32_t>& domain, double irradiance[3], Stats& stats) const;

  std::vector<Vec3d> points_, normals_;
  Options options_;
  std::shared_ptr<const SurfaceTree> surfaces_;
};

}  // namespace deltalux::estimate
