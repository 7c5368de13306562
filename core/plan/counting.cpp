// SPDX-License-Identifier: Apache-2.0
// Converts the statistics of each method into the same kind of counts.
#include "plan/counting.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "base/curve_order.h"
#include "estimate/brute_force.h"
#include "estimate/ray_map/discs.h"

namespace deltalux::plan {
namespace {

constexpr size_t kPortion = 256;  // number of segments that a session passes to an index at a time
constexpr float kAlike = 0.5f;    // cosine: normals closer than this count as similar

segments::SegmentSpan part(const segments::SegmentSpan& s, size_t first, size_t count) {
  return {count,        s.ox + first, s.oy + first,     s.oz + first,       s.dx + first,
          s.dy + first, s.dz + first, s.length + first, s.extended + first, s.power + 3 * first,
          nullptr};
}

Counts counts_of(const estimate::Stats& stats, size_t segments) {
  Counts counts{};
  counts[kSegments] = double(segments);
  counts[kNodeTests] = double(stats.node_tests);
  counts[kDiscTests] = double(stats.disc_tests);
  counts[kSphereTests] = double(stats.sphere_tests);
  counts[kHits] = double(stats.hits);
  counts[kOutlineTests] = double(stats.outline_tests);
  return counts;
}

/// By what power of 2 the number of segments exceeds what fits into a core's own cache.
double doublings(double segments) { return std::log2(std::max(1.0, segments / kNear)); }

/// Computed from the mean length of each level's lists.
double far_tests(const estimate::SphereLevels& levels, double share) {
  double far = 0;
  for (size_t i = 1; i < levels.tests.size() && levels.rebuilds[i]; ++i)
    far += double(levels.tests[i]) *
           doublings(double(levels.tests[i]) / (double(levels.rebuilds[i]) * share));
  return far;
}

}  // namespace

void SegmentSample::add(Vec3f origin, Vec3f direction, float length, float extended) {
  constexpr uint32_t kOne[3] = {1, 1, 1};
  columns_.add(origin, direction, length, extended, kOne);
}

SegmentSample SegmentSample::repeated(size_t times) const {
  SegmentSample many;
  for (size_t k = 0; k < times; ++k) many.columns_.append(span());
  return many;
}

SegmentSample SegmentSample::thinned(size_t wanted) const {
  if (wanted >= count()) return *this;
  std::vector<Vec3f> middle(count());
  for (size_t i = 0; i < count(); ++i) {
    const auto at = [&](int k) { return columns_.column[k][i]; };
    const float half = at(6) <= kFarthest ? 0.5f * at(6) : 0.0f;
    middle[i] = Vec3f{at(0), at(1), at(2)} + Vec3f{at(3), at(4), at(5)} * half;
  }
  const std::vector<uint32_t> order = curve_order(middle, Curve::hilbert);
  std::vector<uint32_t> taken(wanted);
  for (size_t i = 0; i < wanted; ++i)  // the middle of the i-th of `wanted` equal parts
    taken[i] = order[(2 * i + 1) * count() / (2 * wanted)];
  SegmentSample few;
  few.columns_.assign(columns_, taken);
  return few;
}

ScratchSums::ScratchSums(const samples::DiscSet& discs)
    : data_(discs.id.empty() ? 3 : 3 * (size_t(*std::ranges::max_element(discs.id)) + 1)) {}

double turned_share(const samples::DiscSet& discs) {
  size_t turns = 0;
  for (size_t i = 1; i < discs.size(); ++i)
    turns += !(dot(discs.normal[i], discs.normal[i - 1]) >= kAlike);
  return discs.size() > 1 ? double(turns) / double(discs.size() - 1) : 0.0;
}

Counts counts_of(const estimate::Stats& stats, const estimate::SphereLevels& levels,
                 size_t segments, double share) {
  Counts counts = counts_of(stats, segments);
  counts[kFarTests] = far_tests(levels, share);
  counts[kFarHits] = counts[kHits] * doublings(double(segments) / share);
  counts[kRebuilds] = double(std::accumulate(levels.rebuilds.begin(), levels.rebuilds.end(), 0ull));
  return counts;
}

Counts search(const estimate::DiscIndex& index, const segments::SegmentSpan& segments,
              ScratchSums& sums) {
  estimate::Stats stats;
  for (size_t begin = 0; begin < segments.count; begin += kPortion)
    stats += index.accumulate(part(segments, begin, std::min(kPortion, segments.count - begin)), +1,
                              sums.sums());
  return counts_of(stats, segments.count);
}

Counts search(const estimate::SphereCache& cache, const segments::SegmentSpan& segments,
              double share, ScratchSums& sums, const Workers& workers, Progress* progress) {
  const auto found = cache.accumulate_levels(segments, +1, sums.sums(), workers, progress);
  Counts counts = counts_of(found.stats, found.levels, segments.count, share);
  counts[kVisits] = double(cache.discs().size());
  return counts;
}

Counts search_ray_map(const samples::DiscSet& discs, segments::SegmentEnd rule, uint32_t leaf_size,
                      const segments::SegmentSpan& segments, ScratchSums& sums,
                      Progress* progress) {
  estimate::RayMap map(rule, {.leaf_size = leaf_size, .keep = false});
  map.push(segments);
  const estimate::EnergySums to = sums.sums();
  const auto take = [&](std::span<const estimate::RayMapHit> hits) {
    for (const estimate::RayMapHit& hit : hits)
      to.add(0, discs.id[hit.disc], segments.power + 3 * size_t(hit.segment), +1);
  };
  const auto stats = estimate::find_crossings(map, discs, Workers(1), take, progress);
  Counts counts = counts_of(stats.tests, segments.count);
  counts[kVisits] = double(discs.size());
  counts[kBoxTests] = double(stats.box_tests);
  counts[kSplits] = double(stats.splits);
  return counts;
}

Counts search_brute_force(const samples::DiscSet& discs, segments::SegmentEnd rule,
                          const segments::SegmentSpan& segments, ScratchSums& sums) {
  const estimate::BruteForce method(discs, rule);
  Counts counts = counts_of(method.accumulate(segments, +1, sums.sums()), segments.count);
  counts[kTurns] = turned_share(discs) * counts[kDiscTests];
  return counts;
}

}  // namespace deltalux::plan
