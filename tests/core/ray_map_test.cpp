// SPDX-License-Identifier: Apache-2.0
// The ray map's tree spares disc tests; that it finds what brute force finds is every signed
// method's contract (signed_methods_test.cpp).
#include "estimate/ray_map_discs.h"

#include "disc_world.h"

namespace deltalux::estimate {
namespace {

TEST(RayMap, SplitsWhereDiscsAsk) {
  Draw draw(1);
  const samples::DiscSet discs = room(draw, 300, 1, 0.1f, {});
  const Segments s = hostile_segments(draw, discs, 4000, 1, {});
  for (const SegmentEnd rule : kRules) {
    std::vector<int64_t> sums(3 * discs.size());
    const Stats stats =
        RayMapDiscs(discs, rule).accumulate(s.span(false), 1, {sums.data(), discs.size(), false});
    EXPECT_GT(stats.hits, 1000u);
    EXPECT_LT(stats.disc_tests, s.size() * discs.size() / 3 * 2);
  }
}

}  // namespace
}  // namespace deltalux::estimate
