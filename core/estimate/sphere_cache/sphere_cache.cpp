// SPDX-License-Identifier: Apache-2.0
// Visits the samples in order, in one go or divided into runs for several threads. Under
// Containment::all, the spheres' positions follow from the samples alone, so that a run can start
// with the state that the samples before it leave, and gets the same counts as a single pass.
#include "estimate/sphere_cache/sphere_cache.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>

#include "estimate/sphere_cache/run.h"

namespace deltalux::estimate {

using sphere_cache::Root;
using sphere_cache::Run;
using sphere_cache::SphereChain;

SphereCache::SphereCache(samples::DiscSet discs, const SphereCacheOptions& options,
                         const Progress* progress)
    : discs_(std::move(discs)), options_(options) {
  if (!(options_.ratio > 0 && options_.ratio < 1))
    throw OptionError("sphere_cache: ratio: found " + std::to_string(options_.ratio) +
                      ", expected a number between 0 and 1, without them");
  for (size_t k = 0; k < discs_.size(); ++k) {
    const Vec3f c = discs_.centre[k], n = discs_.normal[k];
    if (!std::isfinite(dot(c, c) + dot(n, n) + discs_.radius[k]))
      throw OptionError(
          "sphere_cache: disc " + std::to_string(k) +
          ": found a position, normal or radius that is not finite, expected numbers");
  }
  order_ = curve_order(discs_.centre, options_.order, progress);
}

size_t SphereCache::best_span() const {
  // A visit tests about 25 discs^(-2/3) of the segments, and takes the time of 100 tests itself.
  return std::clamp<size_t>(discs_.size(), size_t(1) << 16, size_t(1) << 20);
}

Stats SphereCache::accumulate(const segments::SegmentSpan& segments, int sign,
                              const EnergySums& sums, HitSlots* slots) const {
  if (slots) std::fill_n(slots, segments.count, HitSlots());
  if (discs_.size() == 0 || segments.count == 0) return {};
  const Root root = sphere_cache::make_root(segments, options_, discs_, nullptr);
  const sphere_cache::Target target{segments, sign, sums, slots};
  Run run(discs_, options_, root, target, SphereChain(root.radius, options_.containment));
  for (const uint32_t disc : order_) run.visit(disc);
  return run.stats;
}

SphereCache::Result SphereCache::accumulate_levels(const segments::SegmentSpan& segments, int sign,
                                                   const EnergySums& sums, const Workers& workers,
                                                   Progress* progress) const {
  if (progress) progress->begin("estimate", order_.size());
  Result result;
  if (discs_.size() == 0) return result;
  const Root root = sphere_cache::make_root(segments, options_, discs_, progress);
  const bool cut = options_.containment == Containment::all && workers.threads() > 1;
  constexpr size_t kMinRun = 64, kRunsPerThread = 4;
  const size_t wanted = cut ? kRunsPerThread * size_t(workers.threads()) : 1;
  const size_t grain = std::max(kMinRun, (order_.size() + wanted - 1) / wanted);

  std::vector<SphereChain> starts;
  SphereChain chain(root.radius, options_.containment);
  for (size_t i = 0; i < order_.size(); ++i) {
    if (i % grain == 0) starts.push_back(chain);
    if (wanted == 1) break;
    if (progress && i % 65536 == 0) progress->check();
    const uint32_t disc = order_[i];
    const auto place = chain.place(discs_.centre[disc], discs_.normal[disc], discs_.radius[disc]);
    const int first = chain.first_to_centre(place, true);
    if (first <= place.last) chain.centre_on(place, first);
  }
  const sphere_cache::Target target{segments, sign, sums, nullptr};
  std::vector<Result> parts(starts.size());
  workers.for_blocks(order_.size(), wanted == 1 ? order_.size() : grain,
                     [&](size_t begin, size_t end) {
                       Run run(discs_, options_, root, target, starts[begin / grain]);
                       for (size_t i = begin; i < end; ++i) {
                         if (progress) progress->check(), progress->advance(1);
                         run.visit(order_[i]);
                       }
                       parts[begin / grain] = {run.stats, run.levels};
                     });

  const size_t levels = root.radius.size();
  const std::vector<uint64_t> none(levels);
  result.levels = {root.radius, none, none, none, none};
  const auto add = [](std::vector<uint64_t>& to, const std::vector<uint64_t>& from) {
    std::transform(to.begin(), to.end(), from.begin(), to.begin(), std::plus<>());
  };
  for (const Result& part : parts) {
    result.stats += part.stats;
    add(result.levels.rebuilds, part.levels.rebuilds);
    add(result.levels.first_misses, part.levels.first_misses);
    add(result.levels.rays, part.levels.rays);
    add(result.levels.tests, part.levels.tests);
  }
  result.levels.rays[0] = segments.count;
  return result;
}

}  // namespace deltalux::estimate
