// SPDX-License-Identifier: Apache-2.0
// Direct light by fewer shadow rays against that of all of them.
#include "direct/light_by_need.h"

#include <gtest/gtest.h>

#include <cmath>

#include "direct_world.h"

namespace deltalux::direct {
namespace {

/// A large panel and forty small ones over a floor, with a shelf between; points on the floor.
struct PanelsAndShelf : World {
  PanelsAndShelf() {
    scene::Object lamps;
    lamps.name = "lamps";
    add_quad(lamps, {-1, 3, -1}, {1, 0, 0}, {0, 0, 1}, 1);
    for (int i = 0; i < 40; ++i)
      add_quad(lamps, {-3 + 0.2f * float(i % 20), 2.8f, i < 20 ? -2.0f : 2.0f}, {0.05f, 0, 0},
               {0, 0, 0.05f}, 1);
    scene::Object shelf;
    shelf.name = "shelf";
    add_box(shelf, {-0.8f, 1, -0.8f}, {0.3f, 1.1f, 0.9f});
    scene.objects = {lamps, shelf};
    finish();
    for (int i = 0; i < 400; ++i)
      receivers.push_back({{-2 + 0.2f * float(i % 20), 0, -2 + 0.2f * float(i / 20)}, {0, 1, 0}});
  }
};

std::vector<Vec3d> by_need(const World& world, std::vector<double> dim, int threads = 1) {
  std::vector<Vec3d> out(world.receivers.size());
  Progress progress;
  light_by_need(world.context(), dim, 1, Workers(threads), progress, out);
  return out;
}

TEST(LightByNeed, IsNearThatOfAllRays) {
  PanelsAndShelf world;
  const DirectLight full = world.compute();
  const std::vector<Vec3d> found = by_need(world, std::vector<double>(world.lights.size(), 1));
  double squares = 0, sum = 0, all = 0;
  for (size_t i = 0; i < found.size(); ++i) {
    const double expected = world.irradiance(full, i);
    squares += std::pow(found[i].x / expected - 1, 2);
    sum += found[i].x, all += expected;
  }
  EXPECT_LT(std::sqrt(squares / double(found.size())), 0.01);
  EXPECT_NEAR(sum / all, 1, 0.001);
}

TEST(LightByNeed, IsExactInTheOpenAndDims) {
  PanelsAndShelf world;
  world.scene.objects.pop_back();
  world.finish();
  const DirectLight full = world.compute();
  const std::vector<double> ones(world.lights.size(), 1), halves(world.lights.size(), 0.5);
  const std::vector<Vec3d> found = by_need(world, ones), half = by_need(world, halves);
  for (size_t i = 0; i < found.size(); ++i) {
    EXPECT_NEAR(found[i].x / world.irradiance(full, i), 1, 1e-6);
    EXPECT_NEAR(half[i].y / found[i].y, 0.5, 1e-12);
    EXPECT_NEAR(found[i].z / found[i].x, 0.6, 1e-6);
  }
  EXPECT_EQ(by_need(world, std::vector<double>(world.lights.size(), 0))[7].x, 0);
}

TEST(LightByNeed, IsDarkBehindAPlateAlsoWhereSliversOfLampsAreInFront) {
  World world;
  scene::Object lamps, plate;
  lamps.name = "lamps", plate.name = "plate";
  for (int i = 0; i < 40; ++i)
    add_quad(lamps, {-1, 2.8f, -4 + 0.2f * float(i)}, {0.05f, 0, 0}, {0, 0, 0.05f}, 1);
  add_box(plate, {-9, 2, -9}, {9, 2.1f, 9});
  world.scene.objects = {lamps, plate};
  world.finish();
  for (int i = 0; i < 200; ++i)
    world.receivers.push_back({{-0.95f - 1e-5f * float(i), 1.5f, 0.3f}, {1, 0, 0}});
  for (const Vec3d& e : by_need(world, std::vector<double>(world.lights.size(), 1)))
    EXPECT_EQ(e.x, 0);
}

TEST(LightByNeed, CountsHalvesOfLampsThatBringLittle) {
  World world;
  scene::Object lamps, covers;
  lamps.name = "lamps", covers.name = "covers";
  add_quad(lamps, {-1, 3, -1}, {2, 0, 0}, {0, 0, 2}, 1);
  for (int i = 0; i < 40; ++i) {
    const float x = -3 + 0.2f * float(i % 20), z = i < 20 ? -2.0f : 2.0f;
    add_quad(lamps, {x, 2.8f, z}, {0.05f, 0, 0}, {0, 0, 0.05f}, 1);
    add_box(covers, {x - 0.01f, 2.798f, z - 0.01f}, {x + 0.025f, 2.799f, z + 0.06f});
  }
  world.scene.objects = {lamps, covers};
  world.finish();
  for (int i = 0; i < 400; ++i)
    world.receivers.push_back(
        {{-1 + 0.1f * float(i % 20), 0, -1 + 0.1f * float(i / 20)}, {0, 1, 0}});
  std::vector<double> all(world.lights.size(), 1), large(world.lights.size());
  for (size_t i = 0; i < all.size(); ++i) large[i] = world.lights[i].area > 1;
  const DirectLight full = world.compute();
  const std::vector<Vec3d> found = by_need(world, all), panel = by_need(world, large);
  double expected = 0, small = 0;
  for (size_t i = 0; i < found.size(); ++i)
    expected += world.irradiance(full, i) - panel[i].x, small += found[i].x - panel[i].x;
  // 16,000 shares of twelve rays; 0.94 where it is the same third for all.
  EXPECT_NEAR(small / expected, 1, 0.01);
}

TEST(LightByNeed, IsTheSameForAnyNumberOfThreads) {
  const PanelsAndShelf world;
  const std::vector<double> ones(world.lights.size(), 1);
  const std::vector<Vec3d> one = by_need(world, ones), two = by_need(world, ones, 2);
  for (size_t i = 0; i < one.size(); ++i)
    for (int c = 0; c < 3; ++c) EXPECT_EQ(one[i][c], two[i][c]);
}

}  // namespace
}  // namespace deltalux::direct
