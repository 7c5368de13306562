// SPDX-License-Identifier: Apache-2.0
// What is known to hide a light does hide all of it; closed walls are known to.
#include "direct/cover.h"

#include <gtest/gtest.h>

#include <random>

#include "direct_world.h"

namespace deltalux::direct {
namespace {

std::unique_ptr<const LightShape> lamp_of(const World& world) {
  return shape_of(world.lights.front(), 0, 1);
}

scene::Object lamp(Vec3f corner, Vec3f u, Vec3f v, int pieces = 1) {
  scene::Object out;
  out.name = "lamp";
  add_quad(out, corner, u, v, 1, pieces);
  return out;
}

/// A panel 2 m above the receivers; a board of `pieces` x `pieces` squares, with or without the
/// one in the middle, between them.
std::unique_ptr<World> board(int pieces, bool whole, bool movable) {
  auto out = std::make_unique<World>();
  World& world = *out;
  scene::Object between;
  between.name = "board";
  between.movable = movable;
  const float side = 1.0f / float(pieces);
  for (int i = 0; i < pieces; ++i)
    for (int j = 0; j < pieces; ++j) {
      if (!whole && i == pieces / 2 && j == pieces / 2) continue;
      // every other one a little higher: covers need not be connected
      const float height = 1.0f + ((i + j) & 1 ? 1e-5f : 0.0f);
      add_quad(between, {-0.5f + side * float(i), height, -0.5f + side * float(j)}, {side, 0, 0},
               {0, 0, side});
    }
  world.scene.objects = {lamp({-0.25f, 2, -0.25f}, {0.5f, 0, 0}, {0, 0, 0.5f}), between};
  world.finish();
  world.receivers = {{{0.01f, 0, 0.02f}, {0, 1, 0}}};
  return out;
}

TEST(Cover, BoardsOfManyPiecesHideAPanelUnlessOneIsMissing) {
  for (const bool movable : {false, true})
    for (const int pieces : {1, 3, 5}) {
      const std::vector<uint32_t> movables(movable ? 1 : 0, 1);
      for (const bool whole : {true, false}) {
        const auto world = board(pieces, whole, movable);
        const auto covered = [&](std::span<const uint32_t> objects) {
          return is_covered(*world->caster, *lamp_of(*world), world->receivers[0], objects);
        };
        EXPECT_EQ(covered(movables), whole);
        EXPECT_EQ(covered({}), whole && !movable);
      }
    }
}

TEST(Cover, SurfacesBehindTheLightHideNothing) {
  World world;
  scene::Object ceiling;
  ceiling.name = "ceiling";
  add_quad(ceiling, {-2, 2.001f, -2}, {4, 0, 0}, {0, 0, 4});
  world.scene.objects = {lamp({-0.5f, 2, -0.5f}, {1, 0, 0}, {0, 0, 1}, 3), ceiling};
  world.finish();
  EXPECT_FALSE(is_covered(*world.caster, *lamp_of(world), {{0, 0, 0}, {0, 1, 0}}, {}));
}

TEST(Cover, NothingIsKnownOfALightAroundTheReceiver) {
  World world;
  scene::Object shell, wall;
  shell.name = "shell", wall.name = "wall";
  add_box(shell, {-3, -3, -3}, {3, 3, 3});
  std::fill(shell.material.begin(), shell.material.end(), 2u);
  add_box(wall, {-1, -1, -1}, {1, 1, 1});
  world.scene.objects = {shell, wall};
  world.finish();
  EXPECT_FALSE(is_covered(*world.caster, *lamp_of(world), {{0, 0, 0}, {0, 1, 0}}, {}));
}

TEST(Cover, RaysToWhatIsCoveredAreAllBlocked) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> unit(0, 1);
  const auto point = [&](float size) {
    return Vec3f{size * (unit(random) - 0.5f), size * (unit(random) - 0.5f),
                 size * (unit(random) - 0.5f)};
  };
  int covered = 0, hidden = 0;
  for (int round = 0; round < 6000; ++round) {
    World world;
    scene::Object things;
    things.name = "things";
    for (int i = 0; i < 4; ++i) {
      const Vec3f low = point(2);
      add_box(things, low,
              low + Vec3f{0.1f + unit(random), 0.1f + unit(random), 0.1f + unit(random)});
    }
    world.scene.objects = {lamp(point(3), point(1), point(1)), things};
    world.finish();
    if (world.lights.empty()) continue;
    const Receiver receiver{point(4), normalize(point(1))};
    const std::unique_ptr<const LightShape> owned = lamp_of(world);
    const LightShape& shape = *owned;
    if (!(shape.open(receiver) > 0)) continue;
    int free = 0;
    for (int i = 0; i < 400 && !free; ++i) {
      const auto ray = shape.glance(receiver, unit(random), unit(random));
      free +=
          ray.irradiance > 0 && !world.caster->occluded_static(ray.origin, ray.direction, ray.to);
    }
    hidden += !free;
    if (!is_covered(*world.caster, shape, receiver, {})) continue;
    ++covered;
    EXPECT_EQ(free, 0) << round;
  }
  EXPECT_GT(covered, 100);
  EXPECT_GT(covered, hidden / 2);
}

}  // namespace
}  // namespace deltalux::direct
