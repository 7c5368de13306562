// SPDX-License-Identifier: Apache-2.0
// A site that is a thousand times as large as its house: what is chosen by size suits the house.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <numeric>
#include <vector>

#include "direct/scales.h"
#include "direct_world.h"
#include "gather/cells/square_edges.h"
#include "samples/placement.h"
#include "window_room.h"

namespace deltalux {
namespace {

/// Squares of such planes in all.
double squares(const std::vector<gather::PlaneSize>& planes, const std::vector<double>& edges) {
  double sum = 0;
  for (size_t i = 0; i < planes.size(); ++i)
    sum += std::max(1.0, planes[i].area / (edges[i] * edges[i]));
  return sum;
}

TEST(SquareEdges, OfARoomStayAsTheyAreUnderAWideDome) {
  std::vector<uint32_t> number(256);  // each plane consists of one triangle, its number
  std::iota(number.begin(), number.end(), 0u);
  for (const double radius : {20.0, 300.0, 1e5}) {
    std::vector<gather::PlaneSize> planes;
    for (size_t i = 0; i < 256; ++i)
      planes.push_back({std::span(number).subspan(i, 1), i < 9 ? 12 : 0.05 * radius * radius});
    const auto edges = gather::square_edges(
        planes, 0.15, [&](std::span<const uint32_t> own) { return own[0] < 9 ? 2 : radius; });
    for (size_t i = 0; i < 9; ++i) EXPECT_LE(edges[i], 0.2) << radius;
    EXPECT_LE(squares(planes, edges), 1 << 17) << radius;
    for (size_t i = 9; i < 256; ++i) EXPECT_LE(edges[i], 0.1 * radius);
  }
}

TEST(SquareEdges, OfAHugeBuildingGrowEvenly) {
  const uint32_t number[] = {0};
  const std::vector<gather::PlaneSize> planes(2000, {number, 60});
  const auto edges = gather::square_edges(planes, 0.15, [](auto) { return 2.0; });
  EXPECT_GT(edges[0], 0.2);  // all may look as large as those of a room
  EXPECT_EQ(edges, std::vector<double>(2000, edges[0]));
  EXPECT_LE(squares(planes, edges), 530000);
  EXPECT_GT(squares(planes, edges), 60000);
}

TEST(SceneSize, ALuminousDomeHasFineQuantaHoweverLargeItIs) {
  for (const float radius : {10.0f, 1e3f, 1e5f}) {
    direct::World world;
    scene::Object dome;
    direct::add_box(dome, Vec3f{1, 1, 1} * -radius, Vec3f{1, 1, 1} * radius);
    for (uint32_t& material : dome.material) material = 2;
    world.scene.objects = {dome};
    world.finish();
    const auto scales = direct::choose_scales(world.lights, 0.5);
    EXPECT_LE(direct::quantum_of(world.lights.at(0), scales), 1e-9 * 10 * std::numbers::pi)
        << radius;
  }
}

TEST(SceneSize, TheGapBelowABlackRoomIsNoRoom) {
  direct::World world;
  world.scene.materials = {{{}, {}, false}, {{0.2f, 0.2f, 0.2f}, {}, false}, {{}, {9, 9, 9}, true}};
  scene::Object room, land, sky;
  plan::add_window_room(room);
  world.scene.objects = {room};
  world.finish();
  const float alone = samples::scene_metre(world.scene, *world.caster);
  EXPECT_GT(alone, 0.5f);
  direct::World site;
  site.scene.materials = world.scene.materials;
  direct::add_quad(land, {-500, -0.01f, -500}, {0, 0, 1000}, {1000, 0, 0}, 1);
  direct::add_box(sky, Vec3f{-500, -500, -500}, Vec3f{500, 500, 500});
  for (uint32_t& material : sky.material) material = 2;
  site.scene.objects = {room, land, sky};
  site.finish();
  const float there = samples::scene_metre(site.scene, *site.caster);
  EXPECT_GT(there, 0.6f * alone);
  EXPECT_LT(there, 1.5f * alone);
}

}  // namespace
}  // namespace deltalux
