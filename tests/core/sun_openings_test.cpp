// SPDX-License-Identifier: Apache-2.0
// Small openings before a sun: where they are, what is reflected into them, and how many paths that
// gets.
#include "plan/sun_openings.h"

#include <gtest/gtest.h>

#include <numbers>

#include "lights/kinds.h"
#include "plan/allotment.h"
#include "window_room.h"

namespace deltalux::plan {
namespace {

constexpr Vec3f kSun{0.1f, -0.7f, -0.7f};  // its direction, through the wall z = 4

/// A house with one opening on land, in the sun.
struct House {
  scene::Scene scene;
  Progress progress;
  std::unique_ptr<trace::RayCaster> caster;

  explicit House(const Vec3f (&window)[2], float land = 60) {
    scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}, {{0.3f, 0.3f, 0.3f}, {}, false}};
    scene::Object house;
    house.name = "house";
    add_window_room(house, window);
    direct::add_quad(house, {2 - land / 2, -0.1f, 2 - land / 2}, {0, 0, land}, {land, 0, 0}, 1);
    scene.objects = {house};
    scene::PunctualLight sun{};
    sun.kind = &lights::kind_named("sun");
    sun.direction = Vec3d(kSun);
    sun.intensity = {1000, 1000, 1000};
    scene.lights = {sun};
    scene.finish();
    caster = std::make_unique<trace::RayCaster>(scene, progress);
  }
  /// The opening around the beam through the middle of the window.
  std::optional<Opening> opening_at(Vec3f middle) const {
    const Vec3f w = normalize(kSun);
    const trace::Hit hit = caster->closest(middle, w);
    return find_opening(*caster, middle + w * (hit.t * 0.999f), -w);
  }
};

constexpr Vec3f kHole[2] = {{1.9f, 1.5f, 4}, {1.96f, 1.56f, 4}};

TEST(SunOpenings, AreFoundWithTheirSize) {
  for (const float size : {0.005f, 0.06f, 0.5f}) {
    const Vec3f window[2] = {{2 - size / 2, 1.5f - size / 2, 4},
                             {2 + size / 2, 1.5f + size / 2, 4}};
    const House house(window);
    const auto opening = house.opening_at({2, 1.5f, 4});
    ASSERT_TRUE(opening) << size;
    EXPECT_LT(length(opening->centre - Vec3f{2, 1.5f, 4}), 0.3f * size) << size;
    EXPECT_NEAR(opening->normal.z, 1, 1e-5) << size;
    EXPECT_GT(opening->radius, 0.3f * size);
    EXPECT_LT(opening->radius, 1.2f * size);
  }
}

TEST(SunOpenings, InTheOpenThereIsNone) {
  const House house(kHole);
  EXPECT_FALSE(find_opening(*house.caster, {20, 0, 20}, normalize(-kSun)));
  EXPECT_FALSE(find_opening(*house.caster, {2, 3.01f, 2}, normalize(-kSun)));  // on the roof
}

TEST(SunOpenings, ChancesAreThoseOfDiffuseReflections) {
  const House house(kHole);
  const Opening opening{{1.93f, 1.53f, 4}, {0, 0, 1}, 0.03f};
  const double area = std::numbers::pi * 0.03 * 0.03;
  const auto found = reflectors_of(house.scene, *house.caster, opening, 512, 3);
  ASSERT_GT(found.size(), 200u);  // half of what the hole sees is land
  for (const Reflector& r : found) {
    EXPECT_EQ(house.scene.material_index(r.primitive), 1u);
    const Vec3d d = Vec3d(r.at) - Vec3d(opening.centre);
    const double squared = dot(d, d), cosines = d.z * -d.y / squared;
    EXPECT_NEAR(r.chance, area * cosines / (std::numbers::pi * squared), 0.1 * r.chance);
  }
}

/// The share of the sun's paths that land on the land within 2 m of the opening.
double share_before(const House& house) {
  std::vector<trace::Light> lights = trace::find_lights(house.scene);
  Progress progress;
  shares_by_use(house.scene, *house.caster, samples_in_window_room(), lights, Workers(2), progress);
  lights[0].path_count = 8192;
  double near = 0;
  for (uint64_t i = 0; i < lights[0].path_count; ++i) {
    const trace::Emission start = trace::emit(lights[0], 1, i, 1);
    const trace::Hit hit = house.caster->closest(start.origin, start.direction);
    const Vec3f p = start.origin + start.direction * hit.t;
    near += hit.valid() && house.scene.material_index(hit.primitive) == 1 && p.z > 4 && p.z < 6 &&
            std::fabs(p.x - 2) < 2;
  }
  return near / double(lights[0].path_count);
}

TEST(SunOpenings, WhatIsReflectedIntoSmallOnesGetsPaths) {
  // A third of the paths go by their chances, of which nearly half are of this land.
  for (const float land : {300.0f, 600.0f})
    EXPECT_GT(share_before(House(kHole, land)), 0.14) << land;
}

}  // namespace
}  // namespace deltalux::plan
