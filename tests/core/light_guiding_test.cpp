// SPDX-License-Identifier: Apache-2.0
// Targets of a luminous sky: what lies behind a window is aimed at, all of it.
#include "plan/light_guiding.h"

#include <gtest/gtest.h>

#include "base/cone.h"
#include "base/random.h"
#include "plan/allotment.h"
#include "window_room.h"

namespace deltalux::plan {
namespace {

/// The map of a black, luminous box of `side` metres around the room, which stands on land of
/// `land` metres.
std::shared_ptr<const trace::AimMap> map_of_sky(float side, float land) {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}, {{}, {1000, 1000, 1000}, true}};
  scene::Object room, sky;
  room.name = "room", sky.name = "sky";
  add_window_room(room);
  direct::add_quad(room, {2 - land / 2, -0.1f, 2 - land / 2}, {0, 0, land}, {land, 0, 0});
  direct::add_box(sky, Vec3f{2, 1.5f, 2} - Vec3f{1, 1, 1} * (side / 2),
                  Vec3f{2, 1.5f, 2} + Vec3f{1, 1, 1} * (side / 2));
  for (uint32_t& material : sky.material) material = 1;
  scene.objects = {room, sky};
  scene.finish();
  Progress progress;
  const trace::RayCaster caster(scene, progress);
  std::vector<trace::Light> lights = trace::find_lights(scene);
  shares_by_use(scene, caster, samples_in_window_room(), lights, Workers(2), progress);
  return lights.at(0).aims;
}

/// Number `i` of some paths through the window.
struct Through {
  Vec3f p, w;
  float place;  ///< see AimMap::density()
  explicit Through(uint32_t i) {
    const auto r = sobol::sample(i, 9);
    p = {kWindow[0].x + (kWindow[1].x - kWindow[0].x) * r[0],
         kWindow[0].y + (kWindow[1].y - kWindow[0].y) * r[1], kWindow[0].z};
    w = cosine_direction({0, 0, -1}, r[2], r[3]);
    place = (float(i % trace::AimMap::kParts) + 0.5f) / float(trace::AimMap::kParts);
  }
};

TEST(LightGuiding, NoPathThroughAWindowPassesBesideAllTargets) {
  // Such a path is not aimed, and brings many times the light of the window when it comes.
  for (const float side : {60.0f, 200.0f, 1500.0f}) {
    const auto aims = map_of_sky(side, 4);
    ASSERT_TRUE(aims) << side;
    size_t missed = 0;
    for (uint32_t i = 0; i < 1 << 15; ++i) {
      const Through path(i);
      missed += !(aims->density(path.place, path.p - path.w * (side / 2), path.w, nullptr, 0) > 0);
    }
    EXPECT_EQ(missed, 0u) << side;
  }
}

TEST(LightGuiding, WhatLiesBetweenTheBallsIsAimedAt) {
  // Land around the house reflects light in, and a path there that is not aimed outshines the room.
  constexpr float kSide = 400;
  const auto aims = map_of_sky(kSide, 0.9f * kSide);
  ASSERT_TRUE(aims);
  size_t missed = 0;
  for (uint32_t i = 0; i < 1 << 15; ++i) {
    const auto r = sobol::sample(i, 10);
    const Vec3f p{-18 + 40 * r[0], -0.1f, -18 + 40 * r[1]};
    const Vec3f w = cosine_direction({0, -1, 0}, r[2], r[3]);
    const float place = (float(i % trace::AimMap::kParts) + 0.5f) / float(trace::AimMap::kParts);
    missed += !(aims->density(place, p - w * (kSide / 2), w, nullptr, 0) > 0);
  }
  EXPECT_EQ(missed, 0u);
}

TEST(LightGuiding, AWideSiteTakesNoPathsFromTheRoom) {
  // A quarter of the pilot's places lies on the land or beyond, and much light lands there.
  for (const float side : {60.0f, 400.0f, 3000.0f}) {
    const auto aims = map_of_sky(side, 0.9f * side);
    ASSERT_TRUE(aims) << side;
    // The share of the aimed paths that would pass through the window, on average over it.
    constexpr float kArea = 1.4f;
    double share = 0;
    constexpr uint32_t kPaths = 1 << 12;
    for (uint32_t i = 0; i < kPaths; ++i) {
      const Through path(i);
      const double solid = double(kArea * -path.w.z) / std::pow(side / 2, 2);
      share += solid / kPaths *
               aims->density(path.place, path.p - path.w * (side / 2), path.w, nullptr, 0);
    }
    EXPECT_GT(share, 0.015) << side;
  }
}

}  // namespace
}  // namespace deltalux::plan
