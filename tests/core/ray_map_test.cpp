// SPDX-License-Identifier: Apache-2.0
// The ray map as a disc method equals brute force: sums by slab, moments, slots, clipped discs.
#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <set>
#include <vector>

#include "base/random.h"
#include "estimate/brute_force.h"
#include "estimate/ray_map_discs.h"

namespace deltalux::estimate {
namespace {

using segments::SegmentEnd;

struct Flights {
  std::vector<float> column[8];
  std::vector<uint32_t> power;
  std::vector<uint16_t> slab;

  segments::SegmentSpan span() const {
    const auto at = [&](int k) { return column[k].data(); };
    return {slab.size(), at(0), at(1), at(2),        at(3),      at(4),
            at(5),       at(6), at(7), power.data(), slab.data()};
  }
};

Vec3f in_cube(const PathRandom& random, uint32_t dimension) {
  return {2 * random(0, dimension) - 1, 2 * random(0, dimension + 1) - 1,
          2 * random(0, dimension + 2) - 1};
}

/// Flights through a cube; some have numbers that no box holds.
Flights make_flights(size_t count) {
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  Flights flights;
  for (size_t i = 0; i < count; ++i) {
    const PathRandom random(1, i);
    const Vec3f o = in_cube(random, 0), d = normalize(in_cube(random, 3));
    const float first = 2 * random(0, 6), second = first + random(0, 7);
    float row[8] = {o.x, o.y, o.z, d.x, d.y, d.z, first, second};
    if (i % 29 == 0) row[i / 29 % 6] = i % 2 ? kNaN : i % 3 ? 1e20f : -1e-30f;
    for (int k = 0; k < 8; ++k) flights.column[k].push_back(row[k]);
    const auto p = uint32_t(i);
    flights.power.insert(flights.power.end(), {p, 2 * p + 1, uint32_t(mix64(p))});
    flights.slab.push_back(uint16_t(i % 3));
  }
  return flights;
}

/// Every third disc is clipped.
samples::DiscSet make_discs(uint32_t count) {
  samples::DiscSet discs;
  for (uint32_t i = 0; i < count; ++i) {
    const PathRandom random(2, i);
    discs.centre.push_back(in_cube(random, 0));
    discs.normal.push_back(normalize(in_cube(random, 3)));
    discs.radius.push_back(0.02f + 0.3f * random(0, 6));
    discs.id.push_back(count - 1 - i);
    discs.outline.push_back(i % 3 ? samples::kWholeDisc : uint32_t(discs.outlines.size()));
    if (i % 3) continue;
    samples::Outline outline;
    for (uint32_t k = 0; k < outline.size(); ++k) outline[k] = 0.4f * random(1, k);
    discs.outlines.push_back(outline);
  }
  return discs;
}

struct Outcome {
  std::vector<int64_t> sums, moments;
  std::vector<HitSlots> slots;
  Stats stats;

  Outcome(const SignedEstimator& method, const Flights& flights)
      : sums(3 * 3 * method.discs().size()), moments(2 * sums.size()), slots(flights.slab.size()) {
    const EnergySums out{sums.data(), method.discs().size(), false, moments.data()};
    stats = method.accumulate(flights.span(), 1, out, slots.data());
  }
};

TEST(RayMap, EqualsBruteForce) {
  const Flights flights = make_flights(4000);
  const samples::DiscSet discs = make_discs(300);
  for (const SegmentEnd rule : {SegmentEnd::first, SegmentEnd::second, SegmentEnd::bounded}) {
    const Outcome expected(BruteForce(discs, rule), flights),
        found(RayMapDiscs(discs, rule), flights);
    EXPECT_GT(found.stats.hits, 1000u);
    EXPECT_EQ(found.stats.hits, expected.stats.hits);
    EXPECT_EQ(found.sums, expected.sums);
    EXPECT_EQ(found.moments, expected.moments);
    // Split, or this would test little.
    EXPECT_LT(found.stats.disc_tests, expected.stats.disc_tests / 3 * 2);
    for (size_t i = 0; i < found.slots.size(); ++i) {
      const auto set = [](const HitSlots& slots) {
        return std::multiset<uint32_t>(slots.disc, slots.disc + 2);
      };
      ASSERT_EQ(set(found.slots[i]), set(expected.slots[i])) << "segment " << i;
    }
  }
}

TEST(RayMap, RemovesWhatItAdded) {
  const Flights flights = make_flights(1000);
  const RayMapDiscs method(make_discs(100), SegmentEnd::bounded);
  Outcome outcome(method, flights);
  const EnergySums out{outcome.sums.data(), 100, false, outcome.moments.data()};
  method.accumulate(flights.span(), -1, out);
  EXPECT_EQ(outcome.sums, std::vector<int64_t>(outcome.sums.size()));
  EXPECT_EQ(outcome.moments, std::vector<int64_t>(outcome.moments.size()));
}

}  // namespace
}  // namespace deltalux::estimate
