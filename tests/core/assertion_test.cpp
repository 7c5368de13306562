// SPDX-License-Identifier: Apache-2.0
// Assertions end the process and say where; without DELTALUX_ASSERTS nothing is evaluated.
#include "base/assertion.h"

#include <gtest/gtest.h>

#include "session/paths/pending.h"

namespace deltalux {
namespace {

#if defined(DELTALUX_ENABLE_ASSERTS)

class AssertionDeathTest : public testing::Test {
 protected:
  void SetUp() override { GTEST_FLAG_SET(death_test_style, "threadsafe"); }
};

TEST_F(AssertionDeathTest, SaysWhereAndWhat) {
  const int two = 2;
  DELTALUX_ASSERT(two == 2);
  EXPECT_DEATH(DELTALUX_ASSERT(two == 3),
               "core/assertion_test.cpp:[0-9]+: assertion failed: two == 3");
}

TEST_F(AssertionDeathTest, NoSlotIsReadBeyondTheLast) {
  segments::BounceSegments stored;
  std::vector<uint32_t> slots;
  stored.allocate(3, {}, slots);
  stored.at(2).length = 1;
  EXPECT_DEATH(stored.at(3), "slot < size_");
  EXPECT_DEATH(stored.extended(2), "extended");
  EXPECT_DEATH(stored.release(2), "length < 0");
}

TEST_F(AssertionDeathTest, NoSumIsThatOfAnotherSample) {
  std::vector<int64_t> data(6);
  const estimate::EnergySums sums{data.data(), 2};
  const uint32_t power[3] = {1, 2, 3};
  sums.add(0, 1, power, +1);
  EXPECT_DEATH(sums.add(0, 2, power, +1), "sample < samples");
}

#else

TEST(Assertion, IsNotEvaluated) {
  int calls = 0;
  DELTALUX_ASSERT(++calls == 7);
  EXPECT_EQ(calls, 0);
}

#endif

TEST(Assertion, MarksAgreeWithTheWaitingPathsAlone) {
  // The second half of a light's six paths: path 4 has slot 1.
  trace::Light light;
  light.path_count = 6;
  const session::World world{session::Options{}};
  session::PathLayer paths(world);
  paths.held = session::HeldPaths({3, 6}, 6, 1);
  paths.held.add(light);
  paths.cut = {session::kNotCut, 2, session::kNotCut};
  const auto agree = [&](std::vector<session::PendingPath> waiting) {
    paths.pending = std::move(waiting);
    return session::agree(paths);
  };
  EXPECT_TRUE(agree({{4, 0, 2, false, {}}}));
  EXPECT_FALSE(agree({{4, 0, 3, false, {}}}));
  EXPECT_FALSE(agree({{3, 0, 2, false, {}}}));
  EXPECT_FALSE(agree({{1, 0, 2, false, {}}}));  // not held
  EXPECT_FALSE(agree({}));
}

}  // namespace
}  // namespace deltalux
