// SPDX-License-Identifier: Apache-2.0
// Disc queries of a ray map. In leaves, SIMD code tests eight segments against one disc at a time.
#include "estimate/ray_map/discs.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "estimate/crossing.h"
#include "estimate/crossing_lanes.h"
#include "estimate/ray_map/clip.h"

namespace deltalux::estimate {
namespace {

Box disc_box(Vec3f c, Vec3f n, float radius) {
  const Vec3f half =
      Vec3f{std::hypot(n.y, n.z), std::hypot(n.z, n.x), std::hypot(n.x, n.y)} * radius;
  return {c - half, c + half};
}

/// The segments that cross a disc, if it were whole.
template <class L>
inline uint32_t cross_disc(const RayLanes<L>& rays, Vec3f centre, Vec3f normal, float disc_radius,
                           segments::SegmentEnd rule) {
  using Floats = typename L::Floats;
  const Floats c[3] = {L::broadcast(centre.x), L::broadcast(centre.y), L::broadcast(centre.z)};
  const Floats n[3] = {L::broadcast(normal.x), L::broadcast(normal.y), L::broadcast(normal.z)};
  const Floats radius = L::broadcast(disc_radius);
  const Floats end = segment_ends<L>(rule, rays.length, rays.extended, radius);
  return rays.valid & cross_circles<L>(rays.o, rays.w, end, c, n, radius * radius);
}

/// A segment is listed in every leaf that it passes; its crossing counts in the leaf that contains
/// it.
bool holds(const Box& cell, Vec3f p) {
  return p.x >= cell.low.x && p.y >= cell.low.y && p.z >= cell.low.z && p.x < cell.high.x &&
         p.y < cell.high.y && p.z < cell.high.z;
}

class CrossingFinder {
 public:
  CrossingFinder(const RayMap& map, const samples::DiscSet& discs,
                 const std::function<void(std::span<const RayMapHit>)>& take, Progress* progress)
      : map_(map), discs_(discs), take_(take), progress_(progress) {}

  Stats operator()(const RayMap::Leaf& leaf) const {
    return lanes::with([&]<class L>(L) { return test<L>(leaf); });
  }

  Stats try_all(std::span<const uint32_t> ids) const {
    std::vector<RayMapHit> hits;
    for (const uint32_t id : ids) {
      if (progress_) progress_->check();
      for (uint32_t k = 0; k < discs_.size(); ++k) try_pair(id, k, nullptr, hits);
    }
    if (!hits.empty()) take_(hits);
    return {.disc_tests = ids.size() * discs_.size(), .hits = hits.size()};
  }

 private:
  template <class L>
  Stats test(const RayMap::Leaf& leaf) const {
    std::vector<RayMapHit> hits;
    uint64_t outline_tests = 0;
    const std::span<const uint32_t> ids = leaf.ids;
    for (size_t first = 0; first < ids.size(); first += 8) {
      if (progress_) progress_->check();
      prefetch_rays(map_.records().data(), ids, first);
      const RayLanes<L> rays(map_.records().data(), ids, first);
      for (const uint32_t k : leaf.queries) {
        uint32_t met =
            cross_disc(rays, discs_.centre[k], discs_.normal[k], discs_.radius[k], map_.rule());
        if (discs_.outline[k] != samples::kWholeDisc) outline_tests += uint64_t(std::popcount(met));
        for (; met; met &= met - 1)
          try_pair(ids[first + size_t(std::countr_zero(met))], k, &leaf.cell, hits);
      }
    }
    if (!hits.empty()) take_(hits);
    return {.disc_tests = ids.size() * leaf.queries.size(),
            .hits = hits.size(),
            .outline_tests = outline_tests};
  }

  void try_pair(uint32_t id, uint32_t k, const Box* cell, std::vector<RayMapHit>& hits) const {
    const RayRecord& r = map_.record(id);
    const Crossing crossing =
        crosses(discs_, k, r.origin, r.direction, r.length, r.extended, map_.rule());
    if (crossing.hit && (!cell || holds(*cell, discs_.centre[k] + crossing.offset)))
      hits.push_back({id, k, crossing.offset});
  }

  const RayMap& map_;
  const samples::DiscSet& discs_;
  const std::function<void(std::span<const RayMapHit>)>& take_;
  Progress* const progress_;
};

}  // namespace

RayMapStats find_crossings(RayMap& map, const samples::DiscSet& discs, const Workers& workers,
                           const std::function<void(std::span<const RayMapHit>)>& take,
                           Progress* progress, uint32_t follower) {
  std::vector<Box> boxes(discs.size());
  float radius = 0;
  for (size_t i = 0; i < boxes.size(); ++i) {
    boxes[i] = disc_box(discs.centre[i], discs.normal[i], discs.radius[i]);
    radius = std::max(radius, discs.radius[i]);
  }
  const CrossingFinder finder(map, discs, take, progress);
  constexpr float kSplitCost = 3.0f;  // SIMD tests are cheap
  RayMapStats stats = map.visit(boxes, {radius, kSplitCost, follower}, finder, workers, progress);
  RayNode& odd = map.odd();
  if (follower && odd.follower != follower) odd.settled = 0, odd.follower = follower;
  odd.for_range(follower ? odd.settled : 0,
                [&](std::span<const uint32_t> ids) { stats.tests += finder.try_all(ids); });
  if (follower) odd.settled = uint32_t(odd.count());
  return stats;
}

Stats RayMapDiscs::accumulate(const segments::SegmentSpan& s, int sign, const EnergySums& sums,
                              HitSlots* slots) const {
  RayMap map(rule_, {.keep = false});
  map.push(s);
  std::vector<uint32_t> found(slots ? s.count : 0);
  if (slots) std::fill_n(slots, s.count, HitSlots());
  const auto take = [&](std::span<const RayMapHit> hits) {
    for (const RayMapHit& hit : hits) {
      const size_t i = hit.segment;
      const uint32_t slab = s.slab ? s.slab[i] : 0;
      const uint32_t* const power = s.power + 3 * i;
      sums.add(slab, discs_.id[hit.disc], power, sign);
      if (sums.moments) add_moments(sums, discs_, hit.disc, hit.offset, slab, power, sign);
      if (!slots) continue;
      const uint32_t place = found[i]++;
      if (place < 2)
        slots[i].disc[place] = hit.disc;
      else
        slots[i].disc[0] = slots[i].disc[1] = HitSlots::kMany;
    }
  };
  return find_crossings(map, discs_, Workers(1), take).tests;
}

}  // namespace deltalux::estimate
