// SPDX-License-Identifier: Apache-2.0
// Photon map (Jensen 1996): irradiance from the k hits nearest to a sample.
#pragma once
#include <memory>
#include <optional>

#include "estimate/estimator.h"
#include "estimate/surface_tree.h"

namespace deltalux::estimate {

inline constexpr double kSameSurface = 0.70710678118654752;  ///< cos 45 degrees

/// The photons near each sample, in ascending order of distance: those of sample i are
/// photon[start[i]] to photon[start[i + 1] - 1], as indices of segments.
struct Neighbours {
  std::vector<uint64_t> start;
  std::vector<uint32_t> photon;
  std::vector<double> distance2;
  std::vector<double> radius2;  ///< squared distance of the farthest photon, per sample
  std::vector<uint32_t> rim;    ///< index of that photon, or kNoTriangle if there is none
  uint64_t tests = 0;           ///< number of photons examined
};

/// The distance to the sample counts the part along the sample's normal `compression` times, so
/// that the search region is a sphere, or an ellipsoid flattened along the normal. Only photons
/// that arrive from the front (direction . normal < 0) count; with `surfaces`, only those on
/// surfaces tilted by less than 45 degrees from the sample's plane.
class PhotonMap final : public GatherEstimator {
 public:
  enum class Kernel : uint8_t { constant, cone, epanechnikov };
  struct Options {
    uint32_t k = 50;
    Kernel kernel = Kernel::constant;
    /// Leaves out the farthest photon, which defines the region: E[(k - 1) / area] is the density,
    /// while E[k / area] is k / (k - 1) times the density.
    bool unbiased = true;
    double compression = 1;  ///< at least 1
    double cone = 1.1;       ///< Jensen's filter constant, at least 1
  };

  /// `surfaces`: divide by the actual area of surfaces within the region (Hey & Purgathofer 2002);
  /// null: by the area of the region's great circle.
  PhotonMap(std::vector<Vec3d> points, std::vector<Vec3d> normals, const Options& options,
            std::shared_ptr<const SurfaceTree> surfaces = nullptr);

  /// If fewer than k photons arrive, uses all of them. The result is 0 for a sample with none, or
  /// with all of them exactly at its point. Throws Cancelled.
  Gathered estimate(const segments::SegmentSpan& segments, const Workers& workers,
                    Progress* progress = nullptr) const override;

  /// The photons that estimate() weighs; without the farthest one if `unbiased`. With `reach2` (one
  /// per sample), all photons within that squared distance instead.
  Neighbours neighbours(const segments::SegmentSpan& segments, const Workers& workers,
                        Progress& progress, const double* reach2 = nullptr) const;
  /// Irradiance from such lists, which may have been edited; the region is given by radius2.
  Gathered weigh(const segments::SegmentSpan& segments, const Neighbours& neighbours,
                 const Workers& workers, Progress& progress) const;

 private:
  double weight(double distance2, double radius2) const;
  double kernel_integral(size_t sample, double radius2) const;
  double area_within(size_t sample, double radius) const;

  std::vector<Vec3d> points_, normals_;
  Options options_;
  std::shared_ptr<const SurfaceTree> surfaces_;
};

}  // namespace deltalux::estimate
