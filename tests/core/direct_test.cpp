// SPDX-License-Identifier: Apache-2.0
// Direct light by shadow rays against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "direct_world.h"
#include "lights/kinds.h"

namespace deltalux::direct {
namespace {

constexpr double kPi = std::numbers::pi;

scene::Object ceiling_panel(float half, float height, uint32_t material = 1, int pieces = 1) {
  scene::Object panel;
  panel.name = "panel";
  add_quad(panel, {-half, height, -half}, {2 * half, 0, 0}, {0, 0, 2 * half}, material, pieces);
  return panel;
}

/// Configuration factor of an element under the corner of a parallel a x b rectangle at distance c
/// (Howell, A Catalog of Radiation Heat Transfer Configuration Factors, B-3).
double parallel_corner(double a, double b, double c) {
  const double A = a / c, B = b / c, p = std::sqrt(1 + A * A), q = std::sqrt(1 + B * B);
  return (A / p * std::atan(B / p) + B / q * std::atan(A / q)) / (2 * kPi);
}

/// The same of an element whose normal points along the rectangle's side a (B-4): the rectangle is
/// c above it and begins at its plane; b is its extent to one side.
double perpendicular_corner(double a, double b, double c) {
  const double r = std::sqrt(a * a + c * c);
  return (std::atan(b / c) - c / r * std::atan(b / r)) / (2 * kPi);
}

TEST(Direct, OpenPanelIsExact) {
  World world;
  world.scene.objects = {ceiling_panel(0.5f, 2)};
  world.finish();
  for (float x : {0.0f, 0.2f, 0.4f}) world.receivers.push_back({{x, 0, 0.1f}, {0, 1, 0}});
  world.receivers.push_back({{0, 1.9f, 0}, {0, 1, 0}});   // near: 256 rays
  world.receivers.push_back({{0, 0, 0}, {0, -1, 0}});     // turned away
  world.receivers.push_back({{0, 2.5f, 0}, {0, -1, 0}});  // behind the panel
  const DirectLight direct = world.compute();
  const auto square = [](double x, double z, double c) {
    return parallel_corner(0.5 + x, 0.5 + z, c) + parallel_corner(0.5 - x, 0.5 + z, c) +
           parallel_corner(0.5 + x, 0.5 - z, c) + parallel_corner(0.5 - x, 0.5 - z, c);
  };
  for (size_t i = 0; i < 3; ++i) {
    const double expected = 10 * kPi * square(world.receivers[i].point.x, 0.1, 2);
    EXPECT_NEAR(world.irradiance(direct, i, 0) / expected, 1, 1e-6);
    EXPECT_NEAR(world.irradiance(direct, i, 2) / expected, 0.6, 1e-6);
  }
  EXPECT_NEAR(world.irradiance(direct, 3) / (10 * kPi * square(0, 0, 2 - double(1.9f))), 1, 1e-6);
  EXPECT_EQ(direct.sums()[3 * 4], 0);
  EXPECT_EQ(direct.sums()[3 * 5], 0);
}

TEST(Direct, PanelAcrossTheReceiversPlaneCountsWhatIsInFront) {
  World world;
  world.scene.objects = {ceiling_panel(0.5f, 2)};
  world.finish();
  world.receivers = {{{0, 0, 0}, {1, 0, 0}}, {{0.3f, 0.5f, 0}, {1, 0, 0}}};
  const DirectLight direct = world.compute();
  EXPECT_NEAR(world.irradiance(direct, 0) / (20 * kPi * perpendicular_corner(0.5, 0.5, 2)), 1,
              1e-6);
  EXPECT_NEAR(world.irradiance(direct, 1) / (20 * kPi * perpendicular_corner(0.5 - 0.3f, 0.5, 1.5)),
              1, 1e-6);
}

TEST(Direct, SmallPanelsAndPanelsInPiecesAreExactToo) {
  const auto error = [](float half, double height, int pieces) {
    World world;
    world.scene.objects = {ceiling_panel(half, float(height), 1, pieces)};
    world.finish();
    EXPECT_EQ(world.lights.size() == 1, pieces == 1);
    world.receivers = {{{half, 0, half}, {0, 1, 0}}};
    const double expected = 10 * kPi * parallel_corner(2 * half, 2 * half, height);
    return std::fabs(world.irradiance(world.compute(), 0) / expected - 1);
  };
  EXPECT_LT(error(0.15f, 3, 1), 2e-6);    // in closed form
  EXPECT_LT(error(0.02f, 3, 1), 1.5e-4);  // at the centre of its triangles
  EXPECT_LT(error(0.5f, 2, 30), 1e-5);
}

TEST(Direct, TwoSidedPanelShinesToBothSides) {
  World world;
  world.scene.objects = {ceiling_panel(0.5f, 2, 2)};
  world.finish();
  world.receivers = {{{0, 1, 0}, {0, 1, 0}}, {{0, 3, 0}, {0, -1, 0}}};
  const DirectLight direct = world.compute();
  EXPECT_GT(direct.sums()[0], 0);
  EXPECT_NEAR(double(direct.sums()[3]) / double(direct.sums()[0]), 1, 1e-6);
}

scene::PunctualLight punctual(const std::string& kind, Vec3d position, Vec3d direction) {
  scene::PunctualLight light;
  light.kind = &lights::kind_named(kind);
  light.position = position;
  light.direction = direction;
  light.intensity = {4, 2, 1};
  if (kind == "spot") light.parameters = {0.1f, 0.5f};
  return light;
}

TEST(Direct, PunctualLightsHaveTheirClosedForms) {
  const Vec3f point{1, 0, 0}, up{0, 1, 0};
  const auto single = [&](const scene::PunctualLight& light, bool roof) {
    World world;
    scene::Object floor;
    add_quad(floor, {-3, 0, -3}, {0, 0, 6}, {6, 0, 0});
    if (roof) add_quad(floor, {-3, 1, -3}, {0, 0, 6}, {6, 0, 0});
    world.scene.objects = {floor};
    world.scene.lights = {light};
    world.finish();
    world.receivers = {{point, up}};
    return world.irradiance(world.compute(), 0, 1);
  };
  const Vec3d down{0, -1, 0};
  const double squared = 1 + 4, cosine = 2 / std::sqrt(squared);
  const auto point_light = punctual("point", {0, 2, 0}, down);
  EXPECT_NEAR(single(point_light, false), 2 * cosine / squared, 1e-6);
  EXPECT_EQ(single(point_light, true), 0);
  const double falloff = std::pow((cosine - 0.5) / (0.9 - 0.5), 2);
  const auto spot = punctual("spot", {0, 2, 0}, down);
  EXPECT_NEAR(single(spot, false), 2 * falloff * cosine / squared, 1e-6);
  EXPECT_EQ(single(punctual("spot", {0, 2, 0}, {0, 1, 0}), false), 0);
  const auto sun = punctual("sun", {}, {0.6, -0.8, 0});
  EXPECT_NEAR(single(sun, false), 2 * 0.8, 1e-6);
  EXPECT_EQ(single(sun, true), 0);
}

TEST(Direct, UmbraIsZeroAndHalfShadowIsHalf) {
  World world;
  scene::Object screen;
  add_quad(screen, {-5, 1, -5}, {5, 0, 0}, {0, 0, 10});  // hides x < 0
  world.scene.objects = {ceiling_panel(0.5f, 2), screen};
  world.finish();
  std::mt19937 random(3);
  std::uniform_real_distribution<float> across(-0.4f, 0.4f);
  // Over x = 0 at height 1: from (0, 0) the panel's half x < 0 is hidden.
  for (int i = 0; i < 400; ++i) world.receivers.push_back({{0, 0, across(random)}, {0, 1, 0}});
  for (int i = 0; i < 100; ++i)
    world.receivers.push_back({{-0.55f + 0.04f * across(random), 0, 0}, {0, 1, 0}});
  const DirectLight direct = world.compute();
  double sum = 0, squares = 0;
  for (size_t i = 0; i < 400; ++i) {
    const double z = world.receivers[i].point.z;
    const double half =
        10 * kPi * (parallel_corner(0.5, 0.5 + z, 2) + parallel_corner(0.5, 0.5 - z, 2));
    const double error = world.irradiance(direct, i) / half - 1;
    sum += error;
    squares += error * error;
  }
  // About 22 strata of 256 lie across the edge; each one's share is uniform: sd 1.1 % of the half.
  const double sd = std::sqrt(squares / 400);
  EXPECT_LT(sd, 0.015);
  EXPECT_LT(std::fabs(sum / 400), 4 * sd / 20);
  for (size_t i = 400; i < 500; ++i) EXPECT_EQ(direct.sums()[3 * i], 0);
}

TEST(Direct, PenumbraReachesToItsDarkEdge) {
  World world;
  scene::Object screen;
  add_quad(screen, {-5, 1, -5}, {5, 0, 0}, {0, 0, 10});
  world.scene.objects = {ceiling_panel(0.5f, 2), screen};
  world.finish();
  // A strip of 1.5 % of the panel shows: too narrow for most of the 36 rays, not for its ends.
  for (int i = 0; i < 100; ++i)
    world.receivers.push_back({{-0.485f, 0, 0.001f * float(i)}, {0, 1, 0}});
  const DirectLight direct = world.compute();
  int dark = 0;
  for (size_t i = 0; i < 100; ++i) dark += direct.sums()[3 * i] == 0;
  EXPECT_LE(dark,
            5);  // the strip is a quarter of a column of 16 strata: 0.76^16 miss it altogether
}

TEST(Direct, PanelJustBelowTheCeilingLightsTheRoomToItsEdges) {
  World world;
  scene::Object room;
  add_quad(room, {-20, 0, -20}, {0, 0, 40}, {40, 0, 0});
  add_quad(room, {-20, 3, -20}, {40, 0, 0}, {0, 0, 40});
  world.scene.objects = {room, ceiling_panel(0.5f, 2.999f)};
  world.finish();
  for (float x = -19.9f; x < 20; x += 0.1f) world.receivers.push_back({{x, 0, 0.3f}, {0, 1, 0}});
  const DirectLight direct = world.compute();
  World open;
  open.scene.objects = {ceiling_panel(0.5f, 2.999f)};
  open.finish();
  open.receivers = world.receivers;
  const DirectLight expected = open.compute();
  for (size_t i = 0; i < direct.sums().size(); ++i) ASSERT_EQ(direct.sums()[i], expected.sums()[i]);
}

}  // namespace
}  // namespace deltalux::direct
