// SPDX-License-Identifier: Apache-2.0
// Aimed paths of area lights: weights make up for where they go.
#include "trace/aim_map.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "base/random.h"
#include "direct_world.h"

namespace deltalux::trace {
namespace {

/// Two targets, with chances that differ from part to part.
AimMap some_map(Vec3f one, float radius) {
  AimMap map;
  map.targets = {{one, radius}, {{3, -1, 0.5f}, 1}};
  double sum = 0;
  for (uint32_t i = 0; i < 2 * AimMap::kParts; ++i) {
    map.below.push_back(float(std::floor(sum * AimMap::kSteps) / AimMap::kSteps));
    sum += i % 5 == 0 ? 0 : (1 + 0.9 * std::sin(i)) / 140;
  }
  return map;
}

Light panel_light(uint32_t material) {
  direct::World world;
  scene::Object panel;
  panel.name = "panel";
  direct::add_quad(panel, {-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, material);
  world.scene.objects = {panel};
  world.finish();
  return world.lights.front();
}

/// Power by octant of the direction and quarter of the panel, over that of paths that are not
/// aimed; and its standard error.
void compare(const AimMap& map, uint32_t material) {
  Light light = panel_light(material);
  ASSERT_EQ(map.flaw(), nullptr);
  light.path_count = 1 << 18;
  constexpr int kBins = 32;
  double sum[2][kBins] = {}, squares[kBins] = {}, mean = 0;
  for (int aimed = 0; aimed < 2; ++aimed) {
    light.aims = aimed ? std::make_shared<AimMap>(map) : nullptr;
    for (uint64_t i = 0; i < light.path_count; ++i) {
      const Emission start = emit(light, 7, i, 1);
      ASSERT_LE(start.weight, AimMap::max_weight() * 1.00001f);
      const int bin = (start.direction.x > 0) + 2 * (start.direction.z > 0.2f) +
                      4 * (start.direction.y > 0) + 8 * (start.origin.x > 0) +
                      16 * (start.origin.z > 0);
      sum[aimed][bin] += double(start.weight);
      if (!aimed) continue;
      squares[bin] += double(start.weight) * double(start.weight);
      mean += double(start.weight) / double(light.path_count);
    }
  }
  EXPECT_NEAR(mean, 1, 0.01);
  for (int bin = 0; bin < kBins; ++bin) {
    // Five standard errors of independent starts: once in 50,000 tests of 32 bins.
    const double error = std::sqrt(squares[bin] + sum[0][bin] + 1);
    EXPECT_NEAR(sum[1][bin], sum[0][bin], 5 * error) << bin;
  }
}

TEST(AimMap, WeightsMakeUpForWhereTheyGo) {
  for (const uint32_t material : {1u, 2u}) {
    compare(some_map({-2, 0, 1}, 0.5f), material);       // below the panel
    compare(some_map({0.5f, 2, 0.5f}, 0.7f), material);  // around a part of it
    compare(some_map({0, 2.5f, 0}, 0.4f), material);     // above: from one side, nothing goes there
    compare(some_map({-900, -800, 300}, 0.3f), material);  // narrower than cosines can tell
  }
}

TEST(AimMap, AFarTargetGetsThePowerThatFallsOnIt) {
  for (const float radius : {10.0f, 0.3f, 0.02f}) {
    const Vec3f centre{-900, -800, 300};
    Light light = panel_light(1);
    AimMap map;  // all parts aim at it
    map.targets = {{centre, radius}};
    for (uint32_t i = 0; i < AimMap::kParts; ++i)
      map.below.push_back(float(i) / float(AimMap::kParts));
    light.aims = std::make_shared<AimMap>(map);
    light.path_count = 1 << 16;
    double power = 0, squares = 0;
    for (uint64_t i = 0; i < light.path_count; ++i) {
      const Emission start = emit(light, 7, i, 1);
      const Vec3d d = Vec3d(centre) - Vec3d(start.origin), w(start.direction);
      // A direction's last digit is some 1e-7 of a distance of 1,240 m.
      if (dot(d, w) < 0 || length(cross(d, w)) > 1.02 * double(radius) + 2e-4) continue;
      power += double(start.weight);
      squares += double(start.weight) * double(start.weight);
    }
    const Vec3d d = Vec3d(centre) - Vec3d{0, 2, 0};
    const double squared = dot(d, d), sine = double(radius) / std::sqrt(squared);
    const double expected = double(light.path_count) * -d.y / std::sqrt(squared) * sine * sine;
    // Four standard errors, and half a percent for the panel's extent.
    EXPECT_NEAR(power, expected, 4 * std::sqrt(squares) + 0.005 * expected) << radius;
    EXPECT_LT(std::sqrt(squares), 0.02 * expected) << radius;
  }
}

TEST(AimMap, HalfOfThePathsGoToTheTargets) {
  AimMap map = some_map({-20, 0, 1}, 0.5f);
  map.targets.resize(1);
  map.below.clear();
  for (uint32_t i = 0; i < AimMap::kParts; ++i) map.below.push_back(float(i) / AimMap::kParts);
  ASSERT_EQ(map.flaw(), nullptr);
  direct::World world;
  scene::Object panel;
  panel.name = "panel";
  direct::add_quad(panel, {-1, 2, -1}, {2, 0, 0}, {0, 0, 2}, 1);
  world.scene.objects = {panel};
  world.finish();
  Light light = world.lights.front();
  light.aims = std::make_shared<AimMap>(map);
  light.path_count = 10000;
  int met = 0;
  for (uint64_t i = 0; i < light.path_count; ++i) {
    const Emission start = emit(light, 7, i, 1);
    const Vec3f d = map.targets[0].centre - start.origin;
    const float along = dot(d, start.direction);
    met += dot(d, d) - along * along < 0.2501f;
  }
  EXPECT_NEAR(met, 5000, 100);
}

TEST(AimMap, WhatNoBakeMakesIsRefused) {
  const auto refused = [](const auto& change) {
    AimMap map = some_map({0, 0, 0}, 1);
    change(map);
    return map.flaw() != nullptr;
  };
  EXPECT_FALSE(refused([](AimMap&) {}));
  EXPECT_TRUE(refused([](AimMap& m) { m.targets.clear(); }));
  EXPECT_TRUE(refused([](AimMap& m) { m.targets.pop_back(); }));
  EXPECT_TRUE(refused([](AimMap& m) { m.targets[0].radius = 0; }));
  EXPECT_TRUE(refused([](AimMap& m) { m.targets[1].centre.x = std::nanf(""); }));
  EXPECT_TRUE(refused([](AimMap& m) { m.below[0] = 0.1f; }));
  EXPECT_TRUE(refused([](AimMap& m) { m.below[3] = std::nanf(""); }));
  EXPECT_TRUE(refused([](AimMap& m) { m.below[20] = 0.9f; }));
  EXPECT_TRUE(refused([](AimMap& m) { m.below.back() = 1; }));
}

}  // namespace
}  // namespace deltalux::trace
