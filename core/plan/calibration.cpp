// SPDX-License-Identifier: Apache-2.0
// Times searches by each method and array size. Short searches are repeated; the shortest time
// counts, since other programs can only add time.
#include "plan/calibration.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <utility>

#include "estimate/sphere_cache/run.h"
#include "plan/calibration_world.h"
#include "plan/fit.h"

namespace deltalux::plan {
namespace {

using segments::SegmentEnd;

constexpr double kLong = 0.008;    // seconds: longer work is not repeated
constexpr double kEnough = 0.004;  // seconds after which shorter work has been repeated enough
constexpr auto kRule = SegmentEnd::first;
constexpr uint32_t kLeafSize = 32;
constexpr size_t kIndexSizes[] = {size_t(1) << 11, size_t(1) << 14, size_t(1) << 17};
constexpr size_t kSpanSizes[] = {size_t(1) << 9, size_t(1) << 13, size_t(1) << 17};

double thread_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

double timed(const std::function<void()>& work) {
  const double start = thread_seconds();
  work();
  return thread_seconds() - start;
}

double best_seconds(const std::function<void()>& work) {
  double best = timed(work), all = best;
  for (bool first = true; all < (first ? kLong : kEnough); first = false) {
    const double again = timed(work);
    best = std::min(best, again), all += again;
  }
  return best;
}

Timed best_of(const std::function<Counts()>& work, Progress* progress) {
  Timed best;
  best.seconds = best_seconds([&] { best.counts = work(); });
  if (progress) progress->check();
  return best;
}

/// Discs whose distances are about as long as their radius.
samples::DiscSet volume(size_t count) {
  return scatter_in_volume(count, 0.6f / std::cbrt(float(count)));
}

/// Sorts discs so that neighbours in space are neighbours in memory, as in a session.
samples::DiscSet in_order(samples::DiscSet discs) {
  const auto order = curve_order(discs.centre, Curve::hilbert);
  samples::DiscSet ordered = discs;
  for (size_t i = 0; i < order.size(); ++i) {
    ordered.centre[i] = discs.centre[order[i]];
    ordered.normal[i] = discs.normal[order[i]];
  }
  return ordered;
}

class Calibration {
 public:
  explicit Calibration(Progress* progress) : progress_(progress), typical_(typical_machine()) {}

  Machine run() {
    Machine machine;
    if (progress_) progress_->begin("calibrate", 4);
    machine[size_t(Method::brute_force)] = brute_force();
    if (progress_) progress_->advance(1);
    machine[size_t(Method::disc_index)] = disc_index();
    if (progress_) progress_->advance(1);
    machine[size_t(Method::ray_map)] = by_span(Method::ray_map, [&](const samples::DiscSet& discs,
                                                                    const SegmentSample& chords) {
      ScratchSums sums(discs);
      return best_of(
          [&] { return search_ray_map(discs, kRule, kLeafSize, chords.span(), sums, progress_); },
          progress_);
    });
    if (progress_) progress_->advance(1);
    machine[size_t(Method::sphere_cache)] = by_span(
        Method::sphere_cache, [&](const samples::DiscSet& discs, const SegmentSample& chords) {
          const estimate::SphereCache cache(discs, {.rule = kRule});
          ScratchSums sums(discs);
          return best_of([&] { return search(cache, chords.span(), 1, sums, one_, progress_); },
                         progress_);
        });
    MethodConstants& cache = machine[size_t(Method::sphere_cache)];
    cache.push_back(with_many_segments(cache.back()));
    for (Constants& constants : cache)
      constants.seconds[kFarTests] = cache.back().seconds[kFarTests];
    const double build = cache_build();
    for (Constants& constants : cache) constants.build = build;
    return machine;
  }

 private:
  Constants fit(Method method, size_t size, std::span<const Timed> searches) const {
    const Constants& prior = typical_[size_t(method)].front();
    return {double(size), fit_constants(searches, prior.seconds), prior.build};
  }

  MethodConstants brute_force() {
    std::vector<Timed> searches;
    for (const samples::DiscSet& discs : {spread_on_ball(2000), volume(2000), volume(2)}) {
      const SegmentSample chords = make_chords(400);
      ScratchSums sums(discs);
      searches.push_back(best_of(
          [&] { return search_brute_force(discs, kRule, chords.span(), sums); }, progress_));
    }
    return {fit(Method::brute_force, 1, searches)};
  }

  MethodConstants disc_index() {
    MethodConstants constants;
    const SegmentSample within = make_chords(32768), beside = make_chords(4096, {9, 9, 9}),
                        left = make_chords(32768, {-0.5f, 0, 0}),
                        right = make_chords(32768, {0.5f, 0, 0});
    for (const size_t size : kIndexSizes) {
      std::vector<Timed> searches;
      double build = 0;
      const auto search_all = [&](const samples::DiscSet& discs,
                                  std::initializer_list<const SegmentSample*> samples) {
        ScratchSums sums(discs);
        std::unique_ptr<estimate::DiscIndex> index;
        build += best_seconds(
            [&] { index = std::make_unique<estimate::DiscIndex>(discs, kRule, one_, progress_); });
        for (const SegmentSample* sample : samples)
          searches.push_back(
              best_of([&] { return search(*index, sample->span(), sums); }, progress_));
      };
      search_all(spread_on_ball(size), {&within, &beside});
      // Both with the same index: discs on the left are clipped, discs on the right are whole.
      search_all(clipped_below(0.5f, in_order(volume(size))), {&left, &right});
      constants.push_back(fit(Method::disc_index, size, searches));
      constants.back().build = build / (2 * double(size));
    }
    return constants;
  }

  /// Times few discs and many, on walls and in a volume, for each number of segments per call.
  MethodConstants by_span(
      Method method,
      const std::function<Timed(const samples::DiscSet&, const SegmentSample&)>& search_timed) {
    MethodConstants constants;
    for (const size_t size : kSpanSizes) {
      const SegmentSample chords = make_chords(size);
      // Enough discs for each search to take a few milliseconds.
      const size_t many = std::clamp<size_t>((size_t(1) << 24) / size, 128, 8192);
      std::vector<Timed> searches;
      for (const samples::DiscSet& discs :
           {scatter_on_walls(2, 0.01f), in_order(scatter_on_walls(many, 0.7f)),
            clipped_below(1, volume(many)), in_order(volume(many)), spread_on_ball(many)})
        searches.push_back(search_timed(discs, chords));
      constants.push_back(fit(method, size, searches));
    }
    return constants;
  }

  /// Times a million segments: they are copied to newly allocated memory, and the outermost lists
  /// are read from memory. Few discs suffice, since those lists are traversed about equally often
  /// for any number of discs. All other costs are as before.
  Constants with_many_segments(const Constants& fewer) {
    const SegmentSample chords = make_chords(kSpanSizes[2]).repeated(8);
    const segments::SegmentSpan span = chords.span();
    const samples::DiscSet discs = scatter_in_volume(24, 0.01f);
    const estimate::SphereCacheOptions options{.rule = kRule};
    ScratchSums scratch(discs);
    const estimate::EnergySums sums = scratch.sums();
    estimate::sphere_cache::Root root;
    const double gathering =
        timed([&] { root = estimate::sphere_cache::make_root(span, options, discs, progress_); });
    const estimate::sphere_cache::Target target{span, +1, sums, nullptr};
    estimate::sphere_cache::Run run(discs, options, root, target,
                                    {root.radius, options.containment});
    run.visit(0);  // allocates the memory of the lists
    const Counts first = counts_of(run.stats, run.levels, span.count, 1);
    const double rest = timed([&] {
      for (uint32_t disc = 1; disc < discs.size(); ++disc) run.visit(disc);
    });
    Counts counts = counts_of(run.stats, run.levels, span.count, 1);
    for (size_t i = 0; i < kCounts; ++i) counts[i] -= first[i];
    const double far = std::exchange(counts[kFarTests], 0);
    Constants many = fewer;
    many.size = double(span.count);
    many.seconds[kSegments] = gathering / many.size;
    // Do not let noise make them free.
    const double least = 0.1 * typical_[size_t(Method::sphere_cache)].front().seconds[kFarTests];
    many.seconds[kFarTests] = std::max(least, (rest - search_seconds(counts, fewer)) / far);
    return many;
  }

  /// The time to sort the discs into the order of visits, in seconds per disc.
  double cache_build() {
    const samples::DiscSet discs = volume(8192);
    return timed([&] { const estimate::SphereCache cache(discs, {.rule = kRule}); }) /
           double(discs.size());
  }

  const Workers one_{1};
  Progress* progress_;
  const Machine typical_;
};

}  // namespace

Machine calibrate(Progress* progress) { return Calibration(progress).run(); }

}  // namespace deltalux::plan
