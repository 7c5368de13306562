// SPDX-License-Identifier: Apache-2.0
// Maps of suns: starts by their chances, weights that make up for them, the same for any threads.
#include "trace/sun_map.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "direct_world.h"
#include "lights/kinds.h"
#include "plan/allotment.h"
#include "window_room.h"

namespace deltalux::trace {
namespace {

/// A quarter of the rectangle divided again.
SunMap some_map() {
  SunMap map;
  map.leaves = {{0, 0, 0.5f, 0},
                {0.5f, 0, 0.25f, 0.3f},
                {0.75f, 0, 0.25f, 0.4f},
                {0.5f, 0.25f, 0.25f, 0.7f},
                {0.75f, 0.25f, 0.25f, 0.72f},
                {0, 0.5f, 0.5f, 0.74f},
                {0.5f, 0.5f, 0.5f, 0.87f}};
  return map;
}

TEST(SunMap, WeightsMakeUpForChances) {
  const SunMap map = some_map();
  ASSERT_EQ(map.flaw(), nullptr);
  constexpr int kSide = 8;
  constexpr uint32_t kCount = 1 << 18;
  double power[kSide][kSide] = {};
  for (uint32_t i = 0; i < kCount; ++i) {
    const auto r = sobol::sample(i, 5);
    const SunMap::Start start = map.start(r[0], r[1]);
    ASSERT_TRUE(start.u >= 0 && start.u < 1 && start.v >= 0 && start.v < 1);
    ASSERT_LE(start.weight, map.max_weight());
    power[int(start.v * kSide)][int(start.u * kSide)] += double(start.weight) / kCount;
  }
  for (auto& row : power)
    for (double own : row) EXPECT_NEAR(own * kSide * kSide, 1, 0.02);
}

TEST(SunMap, WhatNoBakeMakesIsRefused) {
  const auto refused = [](const auto& change) {
    SunMap map = some_map();
    change(map.leaves);
    return map.flaw() != nullptr;
  };
  using Leaves = std::vector<SunMap::Leaf>;
  EXPECT_FALSE(refused([](Leaves&) {}));
  EXPECT_TRUE(refused([](Leaves& l) { l.clear(); }));
  EXPECT_TRUE(refused([](Leaves& l) { l.pop_back(); }));
  EXPECT_TRUE(refused([](Leaves& l) { l[1].u = 0.9f; }));
  EXPECT_TRUE(refused([](Leaves& l) { l[2].below = l[1].below; }));
  EXPECT_TRUE(refused([](Leaves& l) { l[3].below = std::nanf(""); }));
  EXPECT_TRUE(refused([](Leaves& l) { l[6].below = std::nextafterf(1, 0); }));
}

/// A room whose roof has a hole of 20 cm, and a sun above it.
scene::Scene room_with_hole() {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}};
  scene::Object room;
  room.name = "room";
  direct::add_quad(room, {0, 0, 0}, {0, 0, 4}, {4, 0, 0}, 0);
  direct::add_quad(room, {0, 0, 0}, {4, 0, 0}, {0, 3, 0}, 0);
  direct::add_quad(room, {0, 0, 4}, {0, 3, 0}, {4, 0, 0}, 0);
  direct::add_quad(room, {0, 0, 0}, {0, 3, 0}, {0, 0, 4}, 0);
  direct::add_quad(room, {4, 0, 0}, {0, 0, 4}, {0, 3, 0}, 0);
  const float edge[4] = {0, 2, 2.2f, 4};
  for (int i = 0; i < 3; ++i)
    for (int k = 0; k < 3; ++k)
      if (i != 1 || k != 1)
        direct::add_quad(room, {edge[i], 3, edge[k]}, {edge[i + 1] - edge[i], 0, 0},
                         {0, 0, edge[k + 1] - edge[k]}, 0);
  scene.objects = {room};
  scene::PunctualLight sun{};
  sun.kind = &lights::kind_named("sun");
  sun.direction = {-0.2f, -1, 0.1f};
  sun.intensity = {1000, 1000, 1000};
  scene.lights = {sun};
  scene.finish();
  return scene;
}

TEST(SunMap, IsTheSameForAnyThreadsAndFindsAHole) {
  const scene::Scene scene = room_with_hole();
  Progress progress;
  const RayCaster caster(scene, progress);
  std::shared_ptr<const SunMap> maps[2];
  for (int k = 0; k < 2; ++k) {
    std::vector<Light> lights = find_lights(scene);
    const Workers workers(1 + 2 * k);
    plan::shares_by_use(scene, caster, {}, lights, workers, progress);
    maps[k] = lights[0].map;
    ASSERT_TRUE(maps[k]);
  }
  ASSERT_EQ(maps[0]->leaves.size(), maps[1]->leaves.size());
  for (size_t i = 0; i < maps[0]->leaves.size(); ++i) {
    const SunMap::Leaf &a = maps[0]->leaves[i], &b = maps[1]->leaves[i];
    EXPECT_TRUE(a.u == b.u && a.v == b.v && a.size == b.size && a.below == b.below);
  }
  std::vector<Light> lights = find_lights(scene);
  lights[0].map = maps[0];
  lights[0].path_count = 4096;
  size_t within = 0;
  for (uint64_t i = 0; i < lights[0].path_count; ++i) {
    const Emission start = emit(lights[0], 1, i, 1);
    const float t = (3 - start.origin.y) / start.direction.y;
    const Vec3f p = start.origin + start.direction * t;
    within += p.x > 2 && p.x < 2.2f && p.z > 2 && p.z < 2.2f;
  }
  EXPECT_GT(within, 4096 / 4);  // evenly: some eight
}

TEST(SunMap, FindsTheLandThatLightsARoomThroughItsWindow) {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}, {{0.3f, 0.3f, 0.3f}, {}, false}};
  scene::Object house;
  house.name = "house";
  constexpr float kSite = 600;
  direct::add_quad(house, {-kSite / 2, -0.1f, -kSite / 2}, {0, 0, kSite}, {kSite, 0, 0}, 1);
  plan::add_window_room(house);
  scene.objects = {house};
  scene::PunctualLight sun{};
  sun.kind = &lights::kind_named("sun");
  sun.direction = {0.1f, -0.7f, -0.7f};
  sun.intensity = {1000, 1000, 1000};
  scene.lights = {sun};
  scene.finish();
  const samples::SampleSet samples = plan::samples_in_window_room();
  Progress progress;
  const RayCaster caster(scene, progress);
  std::vector<Light> lights = find_lights(scene);
  plan::shares_by_use(scene, caster, samples, lights, Workers(2), progress);
  ASSERT_TRUE(lights[0].map);
  lights[0].path_count = 1 << 16;
  size_t before = 0, through = 0, patch[6][6] = {};
  for (uint64_t i = 0; i < lights[0].path_count; ++i) {
    const Emission start = emit(lights[0], 1, i, 1);
    const auto at = [&](float t) { return start.origin + start.direction * t; };
    const Vec3f land = at((-0.1f - start.origin.y) / start.direction.y);
    const Vec3f pane = at((4 - start.origin.z) / start.direction.z);
    if (land.x > 0.5f && land.x < 3.5f && land.z > 4.5f && land.z < 7.5f)
      ++before, ++patch[int((land.x - 0.5f) * 2)][int((land.z - 4.5f) * 2)];
    through += pane.x > plan::kWindow[0].x && pane.x < plan::kWindow[1].x &&
               pane.y > plan::kWindow[0].y && pane.y < plan::kWindow[1].y;
  }
  // 9 and 1.4 of 360,000 square metres: evenly, 1.6 and 0.3 of the paths
  EXPECT_GT(before, 2000);
  EXPECT_GT(through, 6000);
  // Nowhere is that land taken for useless because no trial that landed there entered the window:
  // 3 in some quarter of a square metre, when two paths of the squares around counted with it.
  for (const auto& row : patch)
    for (const size_t own : row) EXPECT_GT(own, 30);
}

}  // namespace
}  // namespace deltalux::trace
