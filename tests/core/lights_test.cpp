// SPDX-License-Identifier: Apache-2.0
// What holds for every kind of light: paths and shadow rays mean the same light.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "base/cone.h"
#include "base/error.h"
#include "base/random.h"
#include "lights/kinds.h"
#include "scene/scene.h"
#include "sectored.h"
#include "trace/lights.h"

namespace deltalux::lights {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr uint32_t kCount = 1 << 16;

/// Kinds that shine from a point, with parameters.
std::vector<Punctual> placed() {
  Punctual point, spot, narrow, table;
  point.kind = &kind_named("point");
  spot.kind = narrow.kind = &kind_named("spot");
  table.kind = &sectored();
  spot.parameters = {0.2f, 0.7f}, narrow.parameters = {0.0f, 0.01f};
  table.parameters = {1, 0, 0, 0.5f, 1, 0.1f};
  std::vector<Punctual> all{point, spot, narrow, table};
  for (Punctual& light : all) {
    light.position = {1, 2, 3};
    light.direction = normalize(Vec3f{1, -2, 0.5f});
    light.tables = light.kind->prepare(light.parameters);
    light.kind->place(light, {}, {});
  }
  return all;
}

/// At one metre, on a surface that faces the light.
double intensity(const Punctual& light, Vec3f towards) {
  return light.kind->irradiance(light, light.position + towards, -towards, 0);
}

TEST(Lights, PathsCarryWhatReceiversGet) {
  constexpr int kRings = 6;
  for (const Punctual& light : placed()) {
    // By rings about the axis, as far as its cone goes: intensity over the solid angle, and paths.
    const double cone = double(light.kind->cone(light));
    double power[kRings] = {}, paths[kRings] = {};
    Vec3f u, v;
    tangent_frame(light.direction, u, v);
    for (uint32_t i = 0; i < kCount; ++i) {
      const std::array<float, 4> r = sobol::sample(i, 3);
      const double versine = cone * double(r[0]), sine = std::sqrt(versine * (2 - versine));
      const double turn = 2 * kPi * double(r[1]);
      const Vec3f d = u * float(sine * std::cos(turn)) + v * float(sine * std::sin(turn)) +
                      light.direction * float(1 - versine);
      power[int(kRings * r[0])] += intensity(light, d) * 2 * kPi * cone / kCount;
      const Start start = light.kind->start(light, r);
      EXPECT_EQ(start.origin, light.position);
      const Vec3d chord = Vec3d(start.direction) - Vec3d(light.direction);
      const double share = 0.5 * dot(chord, chord) / cone;
      ASSERT_LT(share, 1 + 1e-4);
      paths[std::min(int(kRings * share), kRings - 1)] += light.kind->extent(light) / kCount;
    }
    double sum = 0;
    for (double own : power) sum += own;
    EXPECT_NEAR(sum / light.kind->extent(light), 1, 2e-3) << light.kind->name();
    for (int ring = 0; ring < kRings; ++ring)
      EXPECT_NEAR(paths[ring] / sum, power[ring] / sum, 2e-3) << light.kind->name() << ring;
  }
}

TEST(Lights, MayReachWhereTheyShineAndNotFarBeside) {
  for (const Punctual& light : placed()) {
    const float cone = light.kind->cone(light);
    size_t far_beside = 0, told = 0;
    for (uint32_t i = 0; i < 4096; ++i) {
      const std::array<float, 4> r = sobol::sample(i, 5);
      // Half of the directions within its cone, the others all around.
      const float versine = i % 2 ? cone * r[0] : 2 * r[0];
      const Vec3f d = on_cone(light.direction, 1 - versine, sine_of(1 - versine), r[1]);
      const bool may = light.kind->may_reach(light, light.position + d * 3, 1e-3f);
      ASSERT_TRUE(may || !(intensity(light, d) > 0)) << light.kind->name() << versine;
      if (cone < 1 && versine > 1.2f * cone + 0.02f) ++far_beside, told += !may;
    }
    EXPECT_EQ(told, far_beside) << light.kind->name();
  }
}

TEST(Lights, SpotsHaveTheFalloffOfTheirVersines) {
  for (const std::vector<float>& cone :
       {std::vector<float>{0.2f, 0.7f}, {0, 1e-6f}, {0.5f, 0.5f}, {1.2f, 1.9f}, {0.3f, 2}}) {
    Punctual spot;
    spot.kind = &kind_named("spot");
    spot.parameters = cone;
    spot.direction = normalize(Vec3f{1, -2, 0.5f});
    const double inner = cone[0], outer = cone[1];
    EXPECT_EQ(spot.kind->cone(spot), cone[1]);
    EXPECT_FALSE(spot.kind->is_parallel());
    // Integral of a step up to the inner versine, and of a square from there to the outer one.
    EXPECT_NEAR(spot.kind->extent(spot), 2 * kPi * (inner + (outer - inner) / 3), 1e-12);
    Vec3f u, v;
    tangent_frame(spot.direction, u, v);
    for (int i = 0; i <= 100; ++i) {
      const double versine = std::min(1.9999, 1.3 * outer * (i + 0.5) / 100);
      const double ramp = (outer - versine) / (outer - inner);
      const double share = versine < inner ? 1 : versine > outer ? 0 : ramp * ramp;
      const double sine = std::sqrt(versine * (2 - versine));
      // Whatever the distance.
      const Vec3f way = (u * float(sine) + spot.direction * float(1 - versine)) * 3.0f;
      const double found = spot.kind->irradiance(spot, way, normalize(-way), 0);
      EXPECT_NEAR(9 * found, share, 2e-3) << inner << " " << outer << " " << versine;
      const Vec3f aslant = normalize(-way + cross(way, u) * 0.5f + u);
      const double cosine = -dot(aslant, normalize(way));
      EXPECT_NEAR(9 * spot.kind->irradiance(spot, way, aslant, 0), share * cosine, 2e-3);
      EXPECT_EQ(spot.kind->irradiance(spot, way, -aslant, 0), 0);
    }
  }
}

TEST(Lights, AreNoBrighterThanShadowRaysResolve) {
  Punctual spot = placed()[1];
  const double slack = 0.01, away = 0.002;
  const Vec3f point = spot.position + spot.direction * float(away);
  const double nearest = slack + double(position_slack(spot.position));
  EXPECT_NEAR(
      spot.kind->irradiance(spot, point, -spot.direction, float(slack)) * std::pow(nearest, 3),
      away, 1e-5);
  EXPECT_GT(spot.kind->irradiance(spot, point, -spot.direction, 0) * away * away, 0.99);
}

TEST(Lights, ReachTheirExtentAsPathsOfEveryShare) {
  // At the ends of the random numbers: the axis, the inner rim, and the outer one.
  for (const std::vector<float>& cone : {std::vector<float>{0.2f, 0.7f}, {0, 0.01f}, {0.3f, 2}}) {
    Punctual spot;
    spot.kind = &kind_named("spot");
    spot.parameters = cone;
    spot.position = {1, 2, 3}, spot.direction = {0, -1, 0};
    const auto versine = [&](float share) {
      const Start start = spot.kind->start(spot, {share, 0.3f, 0.9f, 0.8f});
      EXPECT_EQ(start.origin, spot.position);
      EXPECT_NEAR(length(start.direction), 1, 1e-6);
      const Vec3d chord = Vec3d(start.direction) - Vec3d(spot.direction);
      return 0.5 * dot(chord, chord);
    };
    const double inner = cone[0], outer = cone[1], ring = (outer - inner) / 3;
    EXPECT_NEAR(versine(0), 0, 1e-6);
    EXPECT_NEAR(versine(float(inner / (inner + ring))), inner, 1e-5 * outer);
    // Half of the ring's power is within the cube root of a half.
    EXPECT_NEAR(versine(float((inner + ring / 2) / (inner + ring))),
                outer - (outer - inner) * std::cbrt(0.5), 1e-5 * outer);
    EXPECT_LE(versine(0x1.fffffep-1f), outer * (1 + 1e-5));
    EXPECT_GT(versine(0x1.fffffep-1f), 0.98 * outer);
  }
}

TEST(Lights, FollowTheObjectThatCarriesThem) {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}}};
  scene::Object lamp;
  lamp.name = "lamp", lamp.movable = true;
  lamp.vertices = {{0, 0, 0}, {1, 0, 0}, {0, 0, 1}};
  lamp.triangles = {{0, 1, 2}}, lamp.material = {0}, lamp.group = {0};
  scene.objects = {lamp};
  scene::PunctualLight spot;
  spot.name = "spot";
  spot.kind = &kind_named("spot");
  spot.position = {0, 0.5, 0}, spot.direction = {0, -3, 0};
  spot.intensity = {1, 2, 3}, spot.parameters = {0.1f, 0.4f};
  spot.attached = 0;
  scene.lights = {spot};
  scene.finish();
  std::vector<trace::Light> lights = trace::find_lights(scene);
  ASSERT_EQ(lights.size(), 1u);
  const Vec3d power = lights[0].power;
  EXPECT_NEAR(power.y, 2 * 2 * kPi * 0.2, 1e-6);
  EXPECT_EQ(lights[0].max_power, 1);
  EXPECT_EQ(lights[0].punctual.position, (Vec3f{0, 0.5f, 0}));
  EXPECT_EQ(lights[0].punctual.direction, (Vec3f{0, -1, 0}));
  // A quarter turn about x, and a shift.
  Pose& pose = scene.objects[0].pose;
  pose.row[1] = {0, 0, -1}, pose.row[2] = {0, 1, 0};
  pose.translation = {4, 5, 6};
  trace::place_light(scene, lights[0]);
  EXPECT_EQ(lights[0].punctual.position, (Vec3f{4, 5, 6.5f}));
  EXPECT_EQ(lights[0].punctual.direction, (Vec3f{0, 0, -1}));
  EXPECT_EQ(lights[0].bounds.low, lights[0].punctual.position);
  EXPECT_EQ(lights[0].bounds.high, lights[0].punctual.position);
  EXPECT_EQ(lights[0].power, power);
  EXPECT_TRUE(lights[0].on);
  scene.objects[0].present = false;
  trace::place_light(scene, lights[0]);
  EXPECT_FALSE(lights[0].on);
}

TEST(Lights, ShadowRaysEndShortOfTheLight) {
  for (const Punctual& light : placed()) {
    const Vec3f origin{0, 0, 1};
    const auto [direction, to] = light.kind->shadow_ray(light, origin);
    EXPECT_EQ(direction, light.position - origin);
    EXPECT_LT(to, 1);
    EXPECT_GT(to, 0.9999);
  }
}

TEST(Lights, ASunsRectangleIsBehindTheScene) {
  Punctual sun;
  sun.kind = &kind_named("sun");
  sun.direction = normalize(Vec3f{0.3f, -1, 0.2f});
  const Box world{{-1, 0, -2}, {3, 2, 4}};
  sun.kind->place(sun, {}, world);
  EXPECT_TRUE(sun.kind->is_parallel());
  EXPECT_LE(sun.kind->extent(sun), sun.kind->max_extent(sun, world));
  double low = 1e9, high = -1e9;
  for (const float a : {0.0f, 1.0f})
    for (const float b : {0.0f, 1.0f}) {
      const auto [origin, direction] = sun.kind->start(sun, {a, b, 0, 0});
      EXPECT_EQ(direction, sun.direction);
      low = std::min(low, double(dot(origin, direction)));
      high = std::max(high, double(dot(origin, direction)));
    }
  EXPECT_NEAR(low, high, 1e-5);
  for (int i = 0; i < 8; ++i) {
    const Vec3f corner{i & 1 ? 3.0f : -1.0f, i & 2 ? 2.0f : 0.0f, i & 4 ? 4.0f : -2.0f};
    EXPECT_GE(dot(corner, sun.direction), low - 1e-5);
    const Vec3f off = corner - sun.corner;
    for (const Vec3f& side : {sun.frame_u, sun.frame_v}) {
      EXPECT_GE(dot(off, side) / dot(side, side), -1e-5f);
      EXPECT_LE(dot(off, side) / dot(side, side), 1 + 1e-5f);
    }
  }
}

std::string refusal(const auto& work) {
  try {
    work();
  } catch (const SceneError& error) {
    return error.what();
  }
  return {};
}

TEST(Lights, OfAnUnknownKindAreRefused) {
  const std::string found = refusal([] { kind_named("laser"); });
  EXPECT_EQ(
      found.find("kind of light: found \"laser\", expected one of \"point\", \"spot\", \"sun\""),
      0u)
      << found;
}

TEST(Lights, WithOddParametersAreRefused) {
  const auto finished = [](const char* kind, std::vector<float> parameters) {
    scene::Scene scene;
    scene::PunctualLight light;
    light.name = "lamp";
    if (kind) light.kind = &kind_named(kind);
    light.parameters = std::move(parameters);
    scene.lights = {light};
    return refusal([&] { scene.finish(); });
  };
  EXPECT_EQ(finished("point", {}), "");
  EXPECT_EQ(finished("sun", {}), "");
  EXPECT_EQ(finished("spot", {0.1f, 0.2f}), "");
  EXPECT_EQ(finished(nullptr, {}), "light \"lamp\": it is of no kind");
  const std::string odd = "light \"lamp\": found ";
  EXPECT_EQ(finished("point", {1}), odd + "parameters, which a point light has none of");
  EXPECT_EQ(finished("sun", {1}), odd + "parameters, which a sun has none of");
  for (const std::vector<float>& bad : {std::vector<float>{},
                                        {0.1f},
                                        {0.2f, 0.1f},
                                        {0, 0},
                                        {-0.1f, 1},
                                        {0, 2.5f},
                                        {0, NAN},
                                        {0, 1, 1}})
    EXPECT_EQ(finished("spot", bad),
              odd + "other parameters than versines of the inner and the outer half angle");
}

}  // namespace
}  // namespace deltalux::lights
