// SPDX-License-Identifier: Apache-2.0
// The k segments of a ray map that are nearest to a point, and irradiance from them.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "estimate/estimator.h"
#include "estimate/ray_map/ray_map.h"

namespace deltalux::estimate {

/// How far a segment that arrives at a point's front is from it. All but `hit` need it to cross
/// the tangent plane before its end; under SegmentEnd::bounded no distance is less than the radius
/// of the smallest disc for which the crossing comes before the end.
enum class RayMetric : uint8_t {
  hit,       ///< from the point to the segment's first hit
  crossing,  ///< to its crossing of the tangent plane
  line,      ///< to its part in front of the tangent plane
};

struct NearRay {
  double distance;
  /// Of a segment's power, so that sum(weight power) / (pi r^2) over those within r is irradiance.
  double weight;
  uint32_t id;
};

struct NearestOptions {
  RayMetric metric = RayMetric::crossing;
  uint32_t k = 50;
};

/// Calls `take` with the nearest segments of each point, sorted by distance, then by contribution;
/// fewer than k where there are no more. From several threads at a time. `power`: 3 quanta per id.
RayMapStats find_nearest(RayMap& map, std::span<const uint32_t> power,
                         std::span<const Vec3f> points, std::span<const Vec3f> normals,
                         const NearestOptions& options,
                         const std::function<void(size_t, std::span<const NearRay>)>& take,
                         const Workers& workers, Progress* progress = nullptr);

/// Irradiance from the k nearest segments: sum(weight power) / (pi r_k^2) over the k - 1 inner ones
/// (unbiased) or over all k, which overestimates by k / (k - 1). Where r_k is 0 it is 0.
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
  /// The same with all counts of the map.
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
