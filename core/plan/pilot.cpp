// SPDX-License-Identifier: Apache-2.0
// Runs methods on few segments, and extrapolates their counts.
#include "plan/pilot.h"

#include <algorithm>
#include <cmath>

#include "estimate/ray_map/ray_map.h"
#include "plan/methods.h"

namespace deltalux::plan {
namespace {

/// Counts that do not depend on the number of segments, if list lengths are scaled in proportion.
constexpr Count kFixed[] = {kVisits, kBoxTests, kRebuilds, kSplits};

/// Number of a call's segments that the pilot uses.
size_t pilot_size(double per_call, size_t available) {
  const double wanted = std::max(kMinPilot, per_call / kPilotDivisor);
  return std::min(available, size_t(std::ceil(std::min(wanted, per_call))));
}

/// By level: which share of the segments around a sphere is in it, if enough segments are tested.
std::vector<double> shrinking(const estimate::SphereLevels& levels) {
  constexpr uint64_t kTelling = 1000;
  std::vector<double> shrink;
  for (size_t i = 0; i < levels.rays.size(); ++i) {
    if (i > 0 && levels.rays[i] < kTelling) break;
    shrink.push_back(i > 0 ? double(levels.rays[i]) / double(levels.tests[i]) : 1.0);
  }
  return shrink;
}

}  // namespace

Counts Pilot::least(Method method, const Load& load) const {
  const auto n = double(discs().size());
  Counts counts{};
  counts[kSegments] = load.segments;
  if (method == Method::brute_force) {
    counts[kDiscTests] = load.segments * n;
    counts[kTurns] = counts[kDiscTests] * turned_share(discs());
  }
  if (method == Method::disc_index) counts[kNodeTests] = load.segments;
  if (method == Method::ray_map) counts[kVisits] = counts[kBoxTests] = load.calls() * n;
  if (method == Method::sphere_cache) counts[kVisits] = load.calls() * n;
  return counts;
}

Counts Pilot::count(Method method, const SegmentSample& sample, const Load& load,
                    Progress* progress) {
  if (method == Method::brute_force || sample.count() == 0 || discs().size() == 0)
    return least(method, load);
  ScratchSums sums(discs());
  if (method == Method::disc_index) {
    if (!index_)
      index_ = std::make_unique<estimate::DiscIndex>(std::move(discs_), rule_, workers_, progress);
    const auto few = sample.thinned(pilot_size(load.segments, sample.count()));
    Counts counts = search(*index_, few.span(), sums);
    for (double& value : counts) value *= load.segments / double(few.count());
    return counts;
  }
  const double per_call = load.per_call();
  const auto few = sample.thinned(pilot_size(per_call, sample.count()));
  const double share = double(few.count()) / per_call;
  Counts counts;
  if (method == Method::ray_map) {
    const estimate::RayMapOptions full;
    counts = search_ray_map(discs(), rule_, uint32_t(full.leaf_size * share), few.span(), sums,
                            progress);
  } else {
    // Use all segments: a single segment that goes far can determine the radii of all spheres.
    const float largest = *std::ranges::max_element(discs().radius);
    const double outer = load.outer_radius > 0
                             ? load.outer_radius
                             : estimate::enclosing_radius(sample.span(), rule_, largest, progress);
    estimate::SphereCacheOptions options{.rule = rule_, .outer_radius = outer, .share = share};
    options.shrink =
        shrinking(estimate::SphereCache(discs(), options, progress)
                      .accumulate_levels(few.span(), +1, sums.sums(), workers_, progress)
                      .levels);
    const estimate::SphereCache cache(discs(), options, progress);
    counts = search(cache, few.span(), share, sums, workers_, progress);
  }
  for (size_t i = 0; i < kCounts; ++i) {
    const bool fixed = std::ranges::find(kFixed, Count(i)) != std::end(kFixed);
    counts[i] *= load.calls() * (fixed ? 1.0 : 1.0 / share);
  }
  return counts;
}

std::unique_ptr<estimate::SignedEstimator> Pilot::release(Method method, Progress* progress) {
  const bool wants_index = method == Method::disc_index || method == Method::automatic;
  if (index_ && wants_index) return std::move(index_);
  samples::DiscSet own = index_ ? index_->discs() : std::move(discs_);
  index_.reset();
  return make_estimator(method, std::move(own), rule_, workers_, progress);
}

}  // namespace deltalux::plan
