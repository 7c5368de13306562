// SPDX-License-Identifier: Apache-2.0
// Faces in one place: areas and lights count once, and rays hit the one that the rule says.
#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "base/polygon.h"
#include "base/random.h"
#include "direct_world.h"
#include "gather/cells/cells.h"
#include "gather/cells/coverage.h"
#include "scene/coincident_faces.h"

namespace deltalux {
namespace {

using scene::CoincidentFaces;
using scene::Face;

Face triangle(Vec3f a, Vec3f b, Vec3f c) { return {{a, b, c}}; }

TEST(Polygons, WithoutConvexHolesHaveTheRestOfTheArea) {
  const auto random_triangle = [](uint32_t i) {
    const auto r = sobol::sample(i, 1), s = sobol::sample(i, 2);
    return Polygon{
        {double(r[0]), double(r[1])}, {double(r[2]), double(r[3])}, {double(s[0]), double(s[1])}};
  };
  for (uint32_t i = 0; i < 200; ++i) {
    const Polygon square{{0, 0}, {1, 0}, {1, 1}, {0, 1}}, hole = random_triangle(i);
    std::vector<Polygon> rest;
    add_outside(square, hole, rest);
    double area = 0;
    for (const Polygon& part : rest) area += area_of(part);
    EXPECT_NEAR(area, 1 - area_of(hole), 1e-6);
    // What another hole leaves is the same in either order.
    double once = 0, turned = 0;
    const Polygon other = random_triangle(i + 1000);
    for (const bool order : {false, true}) {
      std::vector<Polygon> first, second;
      add_outside(square, order ? other : hole, first);
      for (const Polygon& part : first) add_outside(part, order ? hole : other, second);
      for (const Polygon& part : second) (order ? turned : once) += area_of(part);
    }
    EXPECT_NEAR(once, turned, 1e-6);
  }
}

TEST(CoincidentFaces, AreFoundByPlaceWhateverTheirSize) {
  for (const float small : {1.0f, 0.1f, 1e-3f})
    for (const float height : {0.0f, 1e-4f, -1e-4f, 0.5f}) {
      const Vec3f p{0.31f, height, 0.4f};
      const std::vector<Face> faces{triangle({0, 0, 0}, {0, 0, 5}, {5, 0, 0}),
                                    triangle(p, p + Vec3f{0, 0, small}, p + Vec3f{small, 0, 0}),
                                    triangle({9, 0, 9}, {9, 0, 10}, {10, 0, 9})};
      const CoincidentFaces found(faces, 1e-3f);
      const bool near = height < 0.1f;
      ASSERT_EQ(found.empty(), !near);
      if (!near) continue;
      // Both face up; the first one wins in the same plane, from both sides.
      EXPECT_EQ(found.of(2).size(), 0u);
      if (height == 0) {
        EXPECT_EQ(found.of(0).size(), 0u);
        ASSERT_EQ(found.of(1).size(), 2u);
        EXPECT_EQ(found.of(1)[0].face, 0u);
        EXPECT_EQ(found.of(1)[0].gap, 0);
      } else {
        ASSERT_EQ(found.of(0).size(), 1u);
        ASSERT_EQ(found.of(1).size(), 1u);
        EXPECT_EQ(found.of(0)[0].from_back, height < 0);
        EXPECT_EQ(found.of(1)[0].from_back, height > 0);
        EXPECT_NEAR(found.of(0)[0].gap, 1e-4, 1e-6);
      }
    }
}

TEST(CoincidentFaces, ThatTouchAreNone) {
  const std::vector<Face> faces{triangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0}),
                                triangle({1, 0, 1}, {1, 0, 0}, {0, 0, 1}),
                                triangle({1, 0, 0}, {2, 0, 0}, {1, 1, 0})};
  EXPECT_TRUE(CoincidentFaces(faces, 1e-3f).empty());
}

TEST(CoincidentFaces, ShowTheirFrontsBeforeBacksAndLampsBeforeOthers) {
  const Face up = triangle({0, 0, 0}, {0, 0, 1}, {1, 0, 0});
  const Face down = triangle({0, 0, 0}, {1, 0, 0}, {0, 0, 1});
  Face lamp = up;
  lamp.emits = true;
  {
    const CoincidentFaces found(std::vector{up, down}, 1e-3f);
    ASSERT_EQ(found.of(0).size(), 1u);
    ASSERT_EQ(found.of(1).size(), 1u);
    EXPECT_TRUE(found.of(0)[0].from_back && found.of(1)[0].from_back);
  }
  {
    const CoincidentFaces found(std::vector{up, lamp}, 1e-3f);
    EXPECT_EQ(found.of(0).size(), 2u);
    EXPECT_EQ(found.of(1).size(), 0u);
  }
}

/// Floors of different tessellation in one plane, each of its own material.
struct Floors : direct::World {
  Floors() {
    scene.materials.resize(4, scene.materials[0]);
    for (uint32_t k = 0; k < 3; ++k) {
      scene::Object floor;
      direct::add_quad(floor, {0, 0, 0}, {0, 0, 3}, {3, 0, 0}, k ? k + 1 : 0, 1 + 2 * int(k));
      scene.objects.push_back(floor);
    }
    scene.materials[2].emission = {};
    scene.materials[2].two_sided = false;
    finish();
  }
};

TEST(RayCaster, HitsTheFirstOfFacesInOnePlane) {
  const Floors floors;
  uint32_t first = 0, all = 0;
  for (uint32_t i = 0; i < 4000; ++i) {
    const auto r = sobol::sample(i, 5);
    const Vec3f from{3 * r[0], i % 2 ? 1.0f : -1.0f, 3 * r[1]}, to{3 * r[2], 0, 3 * r[3]};
    const trace::Hit hit = floors.caster->closest(from, normalize(to - from));
    if (!hit.valid()) continue;
    ++all, first += hit.primitive < 2;
  }
  EXPECT_GT(all, 3900u);
  EXPECT_GE(first, all - 2);  // near the diagonal, where rays may miss both halves
}

TEST(Cells, OfFacesInOnePlaneHaveTheAreaOfOne) {
  const Floors floors;
  const gather::Cells cells(floors.scene, *floors.caster, 1);
  double area = 0;
  for (uint32_t cell = 0; cell < cells.size(); ++cell) {
    area += double(cells.area(cell));
    EXPECT_TRUE(cells.area(cell) == 0 || cells.material(cell) == 0);
  }
  EXPECT_NEAR(area, 18, 1e-3);
}

TEST(Lights, ThatLieTwiceShineOnce) {
  for (const uint32_t material : {1u, 2u})
    for (const bool same_object : {false, true})
      for (const float gap : {0.0f, 1e-4f}) {
        direct::World world;
        scene::Object lamp, again;
        direct::add_quad(lamp, {0, 0, 0}, {0, 0, 2}, {2, 0, 0}, material);
        direct::add_quad(same_object ? lamp : again, {1, gap, 0}, {0, 0, 2}, {2, 0, 0}, material,
                         2);
        world.scene.objects = {lamp};
        if (!same_object) world.scene.objects.push_back(again);
        world.finish();
        double area = 0;
        for (const trace::Light& light : world.lights) area += light.area;
        EXPECT_NEAR(area, 6, 1e-3) << material << same_object << gap;
      }
}

/// A sheet that moves through a floor.
struct Sheet : direct::World {
  Sheet() {
    scene::Object floor, sheet;
    direct::add_quad(floor, {-2, 0, -2}, {0, 0, 4}, {4, 0, 0}, 0, 3);
    sheet.movable = true;
    direct::add_quad(sheet, {-0.5f, 0, -0.5f}, {0, 0, 1}, {1, 0, 0});
    scene.objects = {floor, sheet};
    finish();
  }
};

TEST(RayCaster, HitsAMovableBeforeTheStaticSurfaceInWhosePlaneItLies) {
  Sheet world;
  for (const double turn : {0.0, 0.3, 1.1}) {
    Pose& pose = world.scene.objects[1].pose;
    pose.row[0] = {std::cos(turn), 0, std::sin(turn)};
    pose.row[2] = {-std::sin(turn), 0, std::cos(turn)};
    pose.translation = {0.4, 0, -0.3};
    world.caster->update_object(world.scene, 1);
    const Pose inverse = pose.inverse();
    for (uint32_t i = 0; i < 2000; ++i) {
      const auto r = sobol::sample(i, 7);
      const Vec3f from{2 * r[0] - 1, i % 2 ? 1.0f : -1.0f, 2 * r[1] - 1};
      const Vec3f to{3 * r[2] - 1.5f, 0, 3 * r[3] - 1.5f};
      const Vec3f w = normalize(to - from), local = inverse.point(to);
      const float inside = 0.5f - std::max(std::fabs(local.x), std::fabs(local.z));
      if (std::fabs(inside) < 1e-4f) continue;
      const trace::Hit hit = world.caster->closest(from, w);
      ASSERT_TRUE(hit.valid());
      EXPECT_EQ(hit.primitive >= world.scene.static_primitives(), inside > 0);
      // What a segment stores tells the same.
      const trace::Hit fixed = world.caster->closest_static(from, w);
      const trace::Hit stored{fixed.t, fixed.primitive, {}};
      EXPECT_EQ(world.caster->closer(stored, 1, from, w).primitive, hit.primitive);
    }
  }
}

TEST(Coverage, IsTheAreaUnderASheetInThePlane) {
  Sheet world;
  const gather::Cells cells(world.scene, *world.caster, 1);
  for (const double height : {0.0, 2e-5, 1e-4, 2e-3, -1e-4}) {
    world.scene.objects[1].pose.translation = {0.21, height, -0.13};
    world.caster->update_object(world.scene, 1);
    gather::Coverage coverage;
    coverage.compute(world.scene, *world.caster, cells, Workers(1));
    double front = 0, both = 0;
    cells.each_body([&](uint32_t first, uint32_t object, const gather::BodyCells& body) {
      if (object != scene::kNone) return;
      for (uint32_t own = 0; own < body.size(); ++own) {
        const double covered = std::popcount(coverage.covered()[first + own]) /
                               double(gather::BodyCells::kProbes) * cells.area(first + own);
        both += covered;
        if (body.normal(own).y > 0) front += covered;
      }
    });
    EXPECT_NEAR(front, height < 0 ? 0 : 1, 0.05) << height;
    EXPECT_NEAR(both - front, height > 0 ? 0 : 1, 0.05) << height;
  }
}

}  // namespace
}  // namespace deltalux
