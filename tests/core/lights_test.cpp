// SPDX-License-Identifier: Apache-2.0
// What holds for every kind of light: paths and shadow rays mean the same light.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>

#include "base/error.h"
#include "base/random.h"
#include "lights/kinds.h"
#include "scene/scene.h"

namespace deltalux::lights {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr uint32_t kCount = 1 << 16;

/// Kinds that shine from a point, with parameters.
std::vector<Punctual> placed() {
  Punctual point, spot, narrow;
  point.kind = &kind_named("point");
  spot.kind = narrow.kind = &kind_named("spot");
  spot.parameters = {0.2f, 0.7f}, narrow.parameters = {0.0f, 0.01f};
  std::vector<Punctual> all{point, spot, narrow};
  for (Punctual& light : all) {
    light.position = {1, 2, 3};
    light.direction = normalize(Vec3f{1, -2, 0.5f});
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
  sun.kind->place(sun, world);
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
  EXPECT_EQ(refusal([] { kind_named("laser"); }),
            "kind of light: found \"laser\", expected one of \"point\", \"spot\", \"sun\"");
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
  for (const std::vector<float>& bad :
       {std::vector<float>{}, {0.1f}, {0.2f, 0.1f}, {0, 0}, {-0.1f, 1}, {0, 2.5f}, {0, NAN}})
    EXPECT_EQ(finished("spot", bad),
              odd + "other parameters than versines of the inner and the outer half angle");
}

}  // namespace
}  // namespace deltalux::lights
