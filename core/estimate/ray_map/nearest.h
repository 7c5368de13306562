// SPDX-License-Identifier: Apache-2.0
// Finds the k segments of a ray map nearest to a point, and estimates irradiance from them.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "estimate/estimator.h"
#include "estimate/ray_map/ray_map.h"

namespace deltalux::estimate {

/// Defines the distance between a point and a segment that arrives from the front. Except for
/// `hit`, the segment must cross the tangent plane before its end; under SegmentEnd::bounded, the
/// distance is at least the radius of the smallest disc for which the crossing counts.
enum class RayMetric : uint8_t {
  hit,       ///< to the segment's first hit
  crossing,  ///< to its crossing of the tangent plane
  line,      ///< to the part of the segment in front of the plane
};

struct NearRay {
  double distance;
  /// Factor of the segment's power, with which sum(weight power) / (pi r^2) over all segments
  /// within r is the irradiance.
  double weight;
  uint32_t id;
};

struct NearestOptions {
  RayMetric metric = RayMetric::crossing;
  uint32_t k = 50;
};

/// Calls `take` with the nearest segments of each point, sorted by distance, then by contribution;
/// fewer than k if there are no more. May be called from several threads at a time. `power`: 3
/// quanta per id.
RayMapStats find_nearest(RayMap& map, std::span<const uint32_t> power,
                         std::span<const Vec3f> points, std::span<const Vec3f> normals,
                         const NearestOptions& options,
                         const std::function<void(size_t, std::span<const NearRay>)>& take,
                         const Workers& workers, Progress* progress = nullptr);

/// Irradiance from the k nearest segments: sum(weight power) / (pi r_k^2) over the k - 1 inner ones
/// (unbiased), or over all k, which overestimates by k / (k - 1). The result is 0 if r_k is 0.
class RayMapNearest final : public GatherEstimator {
 public:
  RayMapNearest(std::vector<Vec3f> points, std::vector<Vec3f> normals, segments::SegmentEnd rule,
                const NearestOptions& options, bool unbiased, const RayMapOptions& map)
      : points_(std::move(points)),
        normals_(std::move(normals)),
        rule_(rule),
        options_(options),
        unbiased_(unbiased),
        map_(map) {}
  Gathered estimate(const segments::SegmentSpan& segments, const Workers& workers,
                    Progress* progress = nullptr) const override;
  /// The same, with all statistics of the map.
  Gathered estimate(const segments::SegmentSpan& segments, const Workers& workers,
                    Progress* progress, RayMapStats& stats) const;

 private:
  std::vector<Vec3f> points_, normals_;
  segments::SegmentEnd rule_;
  NearestOptions options_;
  bool unbiased_;
  RayMapOptions map_;
};

}  // namespace deltalux::estimate
