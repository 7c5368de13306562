// SPDX-License-Identifier: Apache-2.0
// The contract of signed methods: brute force's sums, moments, slots and hits, from segments in any
// order, in any parts, on any number of threads; what was added and removed leaves exactly nothing.
// With every instruction set that is there. A new method joins by one entry in kMethods.
#include <memory>
#include <numeric>

#include "disc_world.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/ray_map/discs.h"
#include "estimate/sphere_cache/sphere_cache.h"
#include "with_isa.h"

namespace deltalux::estimate {
namespace {

using Made = std::unique_ptr<SignedEstimator>;

struct Method {
  const char* name;
  Made (*make)(const samples::DiscSet& discs, SegmentEnd rule);
};

template <Containment containment>
Made make_cache(const samples::DiscSet& discs, SegmentEnd rule) {
  SphereCacheOptions options;
  options.rule = rule, options.containment = containment;
  options.min_rays = 3;  // so that lists are divided often
  return std::make_unique<SphereCache>(discs, options);
}

const Method kMethods[] = {
    {"BruteForce",
     [](const samples::DiscSet& discs, SegmentEnd rule) -> Made {
       return std::make_unique<BruteForce>(discs, rule);
     }},
    {"DiscIndex",
     [](const samples::DiscSet& discs, SegmentEnd rule) -> Made {
       return std::make_unique<DiscIndex>(discs, rule, Workers(1));
     }},
    {"SphereCacheAll", make_cache<Containment::all>},
    {"SphereCacheNested", make_cache<Containment::nested>},
    {"RayMapDiscs",
     [](const samples::DiscSet& discs, SegmentEnd rule) -> Made {
       return std::make_unique<RayMapDiscs>(discs, rule);
     }},
};

void PrintTo(const Method& method, std::ostream* out) { *out << method.name; }

class SignedMethods : public testing::TestWithParam<std::tuple<Method, Isa>> {
 protected:
  static const Method& method() { return std::get<Method>(GetParam()); }
  static Made make(const samples::DiscSet& discs, SegmentEnd rule) {
    return method().make(discs, rule);
  }
  static uint64_t expect_same(const World& world, SegmentEnd rule, bool slabs = true,
                              bool with_moments = true) {
    return estimate::expect_same(*make(world.discs, rule), world.segments, rule, slabs,
                                 with_moments);
  }

 private:
  const WithIsa isa_{std::get<Isa>(GetParam())};
};

INSTANTIATE_TEST_SUITE_P(All, SignedMethods,
                         testing::Combine(testing::ValuesIn(kMethods),
                                          testing::ValuesIn(available_isas())),
                         [](const auto& info) {
                           return std::string(std::get<Method>(info.param).name) + "_" +
                                  name_of(std::get<Isa>(info.param));
                         });

// ---- equal to brute force -----------------------------------------------------------------------

TEST_P(SignedMethods, EqualBruteForceInRooms) {
  uint64_t hits = 0;
  for (uint64_t seed = 0; seed < 16; ++seed)
    for (const SegmentEnd rule : kRules) {
      SCOPED_TRACE("seed " + std::to_string(seed) + ", rule " + std::to_string(int(rule)));
      hits += expect_same(any_room(seed, 2000), rule, seed % 2 == 1);
    }
  EXPECT_GT(hits, 10000u);
}

TEST_P(SignedMethods, EqualBruteForceWhereRoundingDecides) {
  uint64_t hits = 0;
  for (uint64_t seed = 100; seed < 109; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    hits += expect_same(coarse_room(seed), kRules[seed % 3]);
  }
  EXPECT_GT(hits, 300u);
}

TEST_P(SignedMethods, EqualBruteForceOnDegenerateDiscs) {
  for (const SegmentEnd rule : kRules) expect_same(degenerate_room(8), rule, true, false);
}

TEST_P(SignedMethods, EqualBruteForceWithFewOrNoDiscsAndSegments) {
  Draw draw(7);
  for (const size_t count : {0, 1, 2, 7, 8, 9, 17})
    for (const size_t flights : {0, 1, 2, 300}) {
      World world{room(draw, count, 1, 0.5f, {}), {}};
      world.segments = hostile_segments(draw, world.discs, flights, 1, {});
      for (const SegmentEnd rule : kRules) expect_same(world, rule);
    }
}

TEST_P(SignedMethods, EqualBruteForceOnCoincidentDiscs) {
  Draw draw(6);
  World world;
  for (int k = 0; k < 400; ++k) add_disc(world.discs, {0, 0, 0}, {0, 0, 1}, 1);
  for (uint32_t& id : world.discs.id) id = (399 - id) / 2;  // neither unique nor in order
  clip_some(world.discs, draw, 0.2f);
  for (int i = 0; i < 100; ++i)
    world.segments.add({draw.range(-1, 1), draw.range(-1, 1), 40}, {0, 0, -1}, 39, kInfinity);
  EXPECT_GT(expect_same(world, SegmentEnd::second), 10000u);
}

// Else the comparisons above would say little: lists and trees have to be divided in them.
TEST_P(SignedMethods, SpareDiscTestsAndCountThem) {
  Draw draw(1);
  World world{room(draw, 1000, 1, 0.05f, {}), {}};
  world.segments = hostile_segments(draw, world.discs, 4000, 1, {}, false);
  const uint64_t pairs = world.segments.size() * world.discs.size();
  for (const SegmentEnd rule : kRules) {
    expect_same(world, rule);
    std::vector<int64_t> sums(9 * world.discs.size());
    const Stats stats =
        make(world.discs, rule)
            ->accumulate(world.segments.span(true), 1, {sums.data(), world.discs.size(), false});
    EXPECT_GT(stats.hits, 1000u);
    EXPECT_GE(stats.disc_tests, stats.hits);
    if (std::string(method().name) == "BruteForce")
      EXPECT_EQ(stats.disc_tests, pairs);
    else
      EXPECT_LT(stats.disc_tests, pairs / 3 * 2);
  }
}

// ---- in any order, in any parts, on any number of threads ---------------------------------------

/// Sums by three slabs, with moments.
struct Sums {
  explicit Sums(const samples::DiscSet& discs)
      : samples(discs.size()), energy(9 * samples), moments(18 * samples) {}
  EnergySums out(bool shared = false) {
    return {energy.data(), samples, shared, shared ? nullptr : moments.data()};
  }
  bool operator==(const Sums&) const = default;

  size_t samples;
  std::vector<int64_t> energy, moments;
};

/// Adds or removes these segments in a random order and in random parts; returns the hits.
uint64_t accumulate_in_parts(const SignedEstimator& method, const Segments& segments,
                             std::vector<uint32_t> rows, int sign, Sums& sums, Draw& draw) {
  for (size_t i = rows.size(); i > 1; --i) std::swap(rows[i - 1], rows[draw.below(uint32_t(i))]);
  uint64_t hits = 0;
  for (std::span<const uint32_t> rest = rows; !rest.empty();) {
    const size_t most = draw.chance(0.5f) ? 10 : 700;
    const size_t count = std::min(rest.size(), size_t(draw.below(uint32_t(most))));  // or none
    const Segments part = segments.select(rest.first(count));
    hits += method.accumulate(part.span(true), sign, sums.out()).hits;
    rest = rest.subspan(count);
  }
  return hits;
}

TEST_P(SignedMethods, AddAndRemoveInAnyOrderAndParts) {
  for (uint64_t seed = 0; seed < 9; ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Draw draw(seed);
    const World world = any_room(seed, 300);
    const SegmentEnd rule = kRules[seed % 3];
    const Made method = make(world.discs, rule);
    const BruteForce oracle(world.discs, rule);
    std::vector<uint32_t> all(world.segments.size()), gone, kept;
    std::iota(all.begin(), all.end(), 0u);
    for (const uint32_t row : all) (draw.chance(0.5f) ? gone : kept).push_back(row);
    const Sums nothing(world.discs);
    Sums expected = nothing, sums = nothing;

    const uint64_t hits = oracle.accumulate(world.segments.span(true), 1, expected.out()).hits;
    EXPECT_EQ(accumulate_in_parts(*method, world.segments, all, 1, sums, draw), hits);
    EXPECT_TRUE(sums == expected) << "added";
    EXPECT_FALSE(sums == nothing) << "tests nothing";

    expected = nothing;
    const Segments rest = world.segments.select(kept);
    const uint64_t left = oracle.accumulate(rest.span(true), 1, expected.out()).hits;
    EXPECT_EQ(accumulate_in_parts(*method, world.segments, gone, -1, sums, draw), hits - left);
    EXPECT_TRUE(sums == expected) << "partly removed";
    EXPECT_EQ(accumulate_in_parts(*method, world.segments, kept, -1, sums, draw), left);
    EXPECT_TRUE(sums == nothing) << "removed";
  }
}

TEST_P(SignedMethods, RemoveBeforeAddLeavesNothing) {
  const World world = any_room(4, 300);
  const Made method = make(world.discs, SegmentEnd::bounded);
  Sums sums(world.discs);
  method->accumulate(world.segments.span(true), -1, sums.out());
  EXPECT_FALSE(sums == Sums(world.discs));
  method->accumulate(world.segments.span(true), 1, sums.out());
  EXPECT_TRUE(sums == Sums(world.discs));
}

TEST_P(SignedMethods, ManyThreadsIntoTheSameSums) {
  Draw draw(10);
  World world{room(draw, 200, 1, 0.3f, {}), {}};
  world.segments = hostile_segments(draw, world.discs, 8000, 1, {});
  const Made method = make(world.discs, SegmentEnd::second);
  Sums expected(world.discs), found(world.discs);
  BruteForce(world.discs, SegmentEnd::second)
      .accumulate(world.segments.span(true), 1, expected.out());
  std::vector<uint32_t> rows(world.segments.size());
  std::iota(rows.begin(), rows.end(), 0u);
  for (const int sign : {1, -1}) {
    Workers(4).for_blocks(rows.size(), 500, [&](size_t begin, size_t end) {
      const Segments part =
          world.segments.select(std::span<const uint32_t>(rows).subspan(begin, end - begin));
      method->accumulate(part.span(true), sign, found.out(true));
    });
    EXPECT_EQ(found.energy, sign > 0 ? expected.energy : Sums(world.discs).energy);
  }
}

}  // namespace
}  // namespace deltalux::estimate
