// SPDX-License-Identifier: Apache-2.0
// Numbers of rays: where the noise is, within what was asked for, and nowhere without a reason.
#include "gather/aim/ray_counts.h"

#include <gtest/gtest.h>

#include <vector>

namespace deltalux::gather {
namespace {

constexpr uint32_t kStandard = 256;

/// A few places are ten times as noisy as all others.
std::vector<PilotEstimate> few_noisy() {
  std::vector<PilotEstimate> pilots(1000, {10, 0.01f});
  for (size_t i = 0; i < 40; ++i) pilots[25 * i].variance = 1;
  return pilots;
}

TEST(RayCounts, LieOneAfterTheOther) {
  const std::vector<int8_t> doublings{0, 3, -2, -1, 1};
  const RayCounts rays(doublings, kStandard);
  const uint32_t expected[] = {256, 2048, 64, 128, 512};
  size_t first = 0;
  for (size_t i = 0; i < 5; ++i) {
    EXPECT_EQ(rays.first(i), first);
    EXPECT_EQ(rays.count(i), expected[i]);
    first += expected[i];
  }
  EXPECT_EQ(rays.all(), first);
  EXPECT_EQ(rays.most(), 2048u);
  EXPECT_EQ(RayCounts::rays(40, -2), 32u);
  EXPECT_EQ(RayCounts::rays(16, -2), 16u);
}

TEST(RayNeed, GoesToWhereTheNoiseIs) {
  const std::vector<PilotEstimate> pilots = few_noisy();
  const RayNeed need(pilots, kStandard);
  size_t more = 0;
  for (size_t i = 0; i < pilots.size(); ++i) {
    const int own = need.doublings(pilots[i], kStandard, 0);
    EXPECT_EQ(own > 0, i % 25 == 0);
    more += size_t((1 << own) - 1);
  }
  EXPECT_LE(more, pilots.size() / 2);
  EXPECT_GE(more, pilots.size() / 10);
}

TEST(RayNeed, CountsDarkPlacesAsATenthOfTheMean) {
  const RayNeed need(few_noisy(), kStandard);
  EXPECT_FLOAT_EQ(need.dark, 1);
  // As noisy by its own light as the noisiest, but dark.
  EXPECT_EQ(need.doublings({0.01f, 1e-6f}, kStandard, 0), 0);
  EXPECT_GT(need.doublings({0.01f, 1}, kStandard, 0), 0);
}

TEST(RayNeed, HalvesOnlyWhereHalfWouldDo) {
  const RayNeed need(few_noisy(), kStandard);
  EXPECT_EQ(need.doublings({10, 0}, kStandard, RayCounts::kMinDoublings), RayCounts::kMinDoublings);
  EXPECT_EQ(need.doublings({10, 0}, kStandard, 0), 0);
  const float doubles = need.noise * need.noise * 100 * (kStandard / 64.0f);  // variance, at 10
  EXPECT_EQ(need.doublings({10, 0.9f * doubles}, kStandard, RayCounts::kMinDoublings), 0);
  EXPECT_EQ(need.doublings({10, 1.1f * doubles}, kStandard, RayCounts::kMinDoublings), 1);
}

TEST(RayNeed, IsNowhereWhereAllIsAlikeOrDark) {
  const std::vector<PilotEstimate> alike(100, {3, 0.5f}), dark(100, {0, 0}), still(100, {3, 0});
  for (const auto& pilots : {alike, dark, still}) {
    const RayNeed need(pilots, kStandard);
    EXPECT_EQ(need.flaw(), nullptr);
    for (const PilotEstimate& pilot : pilots) EXPECT_EQ(need.doublings(pilot, kStandard, 0), 0);
  }
}

TEST(RayNeed, GoesBesideBrightPoolsWithinHalfOfWhatThereIs) {
  std::vector<PilotEstimate> pilots(100, {10, 0});
  for (int i = 0; i < 4; ++i) pilots[size_t(i)].beside = 1000;
  const RayNeed few(pilots, kStandard);
  EXPECT_EQ(few.beside, 256);  // from 32 on it would be 28 % more rays
  EXPECT_EQ(few.doublings(pilots[0], kStandard, RayCounts::kMinDoublings), 2);
  EXPECT_EQ(few.doublings({10, 0, 4000}, kStandard, RayCounts::kMinDoublings),
            RayCounts::kMaxDoublings);
  EXPECT_EQ(few.doublings({10, 0, 200}, kStandard, 0), 0);
  for (PilotEstimate& pilot : pilots) pilot.beside = 1000;
  const RayNeed all(pilots, kStandard);
  EXPECT_EQ(all.doublings(pilots[0], kStandard, 0), 0);
  EXPECT_EQ(all.flaw(), nullptr);
}

}  // namespace
}  // namespace deltalux::gather
