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

/// The share of the sun's paths that land at places of which `where` is true.
template <class Where>
double share_that_lands(const House& house, const Where& where) {
  std::vector<trace::Light> lights = trace::find_lights(house.scene);
  std::vector<Vec3f> reflectance;
  for (const scene::Material& material : house.scene.materials)
    reflectance.push_back(material.reflectance);
  Progress progress;
  shares_by_use(house.scene, reflectance, *house.caster, samples_in_window_room(), lights,
                Workers(2), progress);
  lights[0].path_count = 65536;
  double there = 0;
  for (uint64_t i = 0; i < lights[0].path_count; ++i) {
    const trace::Emission start = trace::emit(lights[0], 1, i, 1);
    const trace::Hit hit = house.caster->closest(start.origin, start.direction);
    there += hit.valid() && where(start.origin + start.direction * hit.t, hit.primitive);
  }
  return there / double(lights[0].path_count);
}

TEST(SunOpenings, WhatIsReflectedIntoSmallOnesGetsPaths) {
  // A third of the paths go by their chances, of which nearly half are of this land.
  for (const float land : {300.0f, 600.0f}) {
    const House house(kHole, land);
    const auto before_it = [&](Vec3f p, uint32_t primitive) {
      return house.scene.material_index(primitive) == 1 && p.z > 4 && p.z < 6 &&
             std::fabs(p.x - 2) < 2;
    };
    EXPECT_GT(share_that_lands(house, before_it), 0.14) << land;
  }
}

TEST(SunOpenings, BeamsOfMillimetresAreFound) {
  // Of starts spread over the land, one in 1e8 enters. More paths than these go to what land
  // reflects into the hole, which is noisier.
  for (const Vec3f at : {Vec3f{1.9f, 1.5f, 4}, {3.1f, 0.7f, 4}, {0.6f, 2.2f, 4}})
    for (const float size : {0.003f, 0.005f, 0.01f}) {
      const House house({at, at + Vec3f{size, size, 0}});
      const auto on_floor = [](Vec3f p, uint32_t) {
        return p.x > 0 && p.x < 4 && p.z > 0 && p.z < 4 && std::fabs(p.y) < 0.01f;
      };
      EXPECT_GT(share_that_lands(house, on_floor), 1e-4) << size << " at " << at.x;
    }
}

}  // namespace
}  // namespace deltalux::plan
