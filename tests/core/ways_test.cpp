// SPDX-License-Identifier: Apache-2.0
// Many ways at once are marked as they would be one by one, and for each point where they may end.
#include "trace/ways.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <random>
#include <vector>

#include "trace/change.h"

namespace deltalux::trace {
namespace {

using Random = std::mt19937;

/// A point of the cube around the origin.
Vec3f drawn(Random& random, float half) {
  std::uniform_real_distribution<float> within(-half, half);
  const float x = within(random), y = within(random), z = within(random);
  return {x, y, z};
}

Box around(Vec3f a, Vec3f b) { return {min(a, b), max(a, b)}; }

TEST(Ways, AreMarkedLikeOneByOne) {
  size_t met = 0, all = 0;
  for (uint32_t world = 0; world < 200; ++world) {
    Random random(world);
    const std::array<Box, 2> boxes{around(drawn(random, 1), drawn(random, 1)),
                                   around(drawn(random, 1), drawn(random, 1))};
    const Vec3f from = drawn(random, 1.5f);
    Ways ways;
    ways.clear(100);
    std::vector<Vec3f> ends;
    for (int i = 0; i < 100; ++i) ways.add(ends.emplace_back(drawn(random, 1.5f)));
    ways.unmark();
    ways.mark_meeting(boxes, from);
    for (size_t i = 0; i < ways.size(); ++i) {
      ASSERT_EQ(ways.marked(i), meets_any(boxes, from, ends[i])) << world << ", way " << i;
      met += ways.marked(i), ++all;
    }
  }
  EXPECT_GT(met, all / 20);
  EXPECT_LT(met, all / 2);
}

TEST(Ways, ThatMayEndAnywhereInABallAreMarkedForEachEnd) {
  size_t grown = 0;
  for (uint32_t world = 0; world < 400; ++world) {
    Random random(world);
    const Box box = around(drawn(random, 1), drawn(random, 1));
    const Vec3f from = drawn(random, 1.5f), centre = drawn(random, 1.5f);
    const float radius = std::fabs(drawn(random, 0.5f).x);
    Ways ways;
    ways.clear(1);
    ways.add(centre, radius);
    ways.unmark();
    ways.mark_meeting({&box, 1}, from);
    grown += ways.marked(0) && !meets_any({&box, 1}, from, centre);
    if (ways.marked(0)) continue;
    for (int i = 0; i < 200; ++i) {
      const Vec3f off = drawn(random, radius);
      if (length(off) < radius) {
        EXPECT_FALSE(meets_any({&box, 1}, from, centre + off)) << world;
      }
    }
  }
  EXPECT_GT(grown, 10u);
}

TEST(Ways, AlongAnAxisAndOfNoLength) {
  const std::array<Box, 2> boxes{Box{{-1, -1, -1}, {1, 1, 1}}, Box{}};  // the second is empty
  Ways ways;
  ways.clear(4);
  const Vec3f from{0, 0.5f, -3};
  for (const Vec3f end : {Vec3f{0, 0.5f, 3}, Vec3f{0, 0.5f, -1.5f}, Vec3f{0, 0.5f, -3}, from})
    ways.add(end);
  ways.unmark();
  ways.mark_meeting(boxes, from);
  EXPECT_TRUE(ways.marked(0));   // through the box, parallel to four of its faces
  EXPECT_FALSE(ways.marked(1));  // ends before it
  EXPECT_FALSE(ways.marked(2));  // of no length, outside
  ways.unmark();
  EXPECT_FALSE(ways.marked(0));
  ways.mark_meeting(boxes, {0, 0.5f, 1});  // on a face
  EXPECT_TRUE(ways.marked(0));
  EXPECT_TRUE(ways.marked(1));
  for (const float side : {-1.0f, 1.0f}) {  // within a face
    ways.clear(1);
    ways.add({side, 0.5f, 3});
    ways.unmark();
    ways.mark_meeting(boxes, {side, 0.5f, -3});
    EXPECT_TRUE(ways.marked(0)) << side;
  }
}

}  // namespace
}  // namespace deltalux::trace
