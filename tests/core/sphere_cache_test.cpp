// SPDX-License-Identifier: Apache-2.0
// The sphere cache equals brute force on ordinary and on hostile input: sums, moments, slots, hits,
// with every containment that promises it, every number of lanes; and counts alike on all threads.
#include "estimate/sphere_cache/sphere_cache.h"

#include "base/error.h"
#include "disc_world.h"

namespace deltalux::estimate {
namespace {

using sphere_cache::Lanes;

/// A cache whose lists are divided often; options go round with the seed.
SphereCacheOptions options_of(uint64_t seed, SegmentEnd rule) {
  SphereCacheOptions options;
  options.rule = rule;
  options.ratio = seed % 5 == 0 ? 0.9 : 2.0 / 3;
  options.min_rays = 1 + seed % 7;
  options.order = seed % 4 == 0 ? Curve::lebesgue : Curve::hilbert;
  options.containment = seed % 3 == 0 ? Containment::nested : Containment::all;
  options.lanes = seed % 3 == 1 ? Lanes::one : seed % 3 == 2 ? Lanes::eight : Lanes::widest;
  return options;
}

TEST(SphereCache, EqualsBruteForceInRooms) {
  uint64_t hits = 0;
  for (uint64_t seed = 0; seed < 24; ++seed) {
    const World world = any_room(seed, 1000);
    for (const SegmentEnd rule : kRules) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", rule " + std::to_string(int(rule)));
      const SphereCache cache(world.discs, options_of(seed, rule));
      hits += expect_same(cache, world.segments, rule, seed % 2 == 1);
    }
  }
  EXPECT_GT(hits, 10000u);
}

TEST(SphereCache, EqualsBruteForceWhereRoundingDecides) {
  uint64_t hits = 0;
  for (uint64_t seed = 100; seed < 116; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    const World world = coarse_room(seed);
    SphereCacheOptions options = options_of(seed, kRules[seed % 3]);
    options.outer_radius = 60;
    hits += expect_same(SphereCache(world.discs, options), world.segments, options.rule);
  }
  EXPECT_GT(hits, 500u);
}

// One walk on one thread is the definition of the statistics.
TEST(SphereCache, CountsAlikeWithAnyLanesAndThreads) {
  Draw draw(9);
  const samples::DiscSet discs = room(draw, 3000, 1, 0.03f, {});
  const Segments s = hostile_segments(draw, discs, 5000, 1, {});
  for (const Containment containment :
       {Containment::all, Containment::nested, Containment::literal}) {
    std::vector<SphereCache::Result> results;
    for (const Lanes lanes : {Lanes::one, Lanes::eight, Lanes::widest})
      for (const int threads : {1, 3}) {
        SphereCacheOptions options;
        options.containment = containment, options.lanes = lanes, options.min_rays = 5;
        std::vector<int64_t> sums(3 * discs.size());
        results.push_back(SphereCache(discs, options)
                              .accumulate_levels(s.span(false), 1,
                                                 {sums.data(), discs.size(), false},
                                                 Workers(threads)));
      }
    for (const SphereCache::Result& r : results) {
      EXPECT_EQ(r.levels.rebuilds, results[0].levels.rebuilds);
      EXPECT_EQ(r.levels.first_misses, results[0].levels.first_misses);
      EXPECT_EQ(r.levels.rays, results[0].levels.rays);
      EXPECT_EQ(r.stats.sphere_tests, results[0].stats.sphere_tests);
      EXPECT_EQ(r.stats.disc_tests, results[0].stats.disc_tests);
      EXPECT_EQ(r.stats.hits, results[0].stats.hits);
    }
    const auto& rebuilds = results[0].levels.rebuilds;
    EXPECT_GT(*std::max_element(rebuilds.begin(), rebuilds.end()), 50u);
  }
}

TEST(SphereCache, AsksForLongSpans) { EXPECT_GE(SphereCache({}, {}).best_span(), 65536u); }

TEST(SphereCache, RefusesWhatIsNotFinite) {
  samples::DiscSet discs;
  add_disc(discs, {0, 0, 0}, {0, 0, 1}, 1);
  SphereCacheOptions options;
  for (const double ratio : {0.0, 1.0, -1.0, double(kNaN)}) {
    options.ratio = ratio;
    EXPECT_THROW(SphereCache(discs, options), OptionError);
  }
  discs.centre[0].y = kNaN;
  EXPECT_THROW(SphereCache(discs, {}), OptionError);
}

}  // namespace
}  // namespace deltalux::estimate
