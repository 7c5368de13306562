// SPDX-License-Identifier: Apache-2.0
// Bounds of objects are a function of the scene, whichever way the objects came into it.
#include <gtest/gtest.h>
#include <malloc.h>

#include <optional>

#include "direct_world.h"
#include "trace/ray_caster.h"

namespace deltalux::trace {
namespace {

scene::Scene room() {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}};
  scene::Object walls, crate;
  direct::add_box(walls, {4, 2, 3}, {-4, 0, -3});
  direct::add_box(crate, {0, 0, 0}, {0.3f, 0.5f, 0.3f});
  crate.movable = true;
  scene.objects = {walls, crate};
  scene.finish();
  return scene;
}

/// A long thin triangle, whose plane is known badly.
scene::Object sliver() {
  scene::Object leaf;
  leaf.name = "leaf";
  leaf.vertices = {{0, 0, 0}, {1, 0.3f, 0}, {0.5f, 0.16f, 0.001f}};
  leaf.triangles = {{0, 1, 2}};
  leaf.material = leaf.group = {0};
  leaf.movable = true;
  return leaf;
}

bool same(const RayCaster& one, const RayCaster& other, uint32_t objects) {
  bool all = one.margin() == other.margin();
  for (uint32_t i = 0; i < objects; ++i)
    all = all && one.object_bounds(i).low == other.object_bounds(i).low &&
          one.object_bounds(i).high == other.object_bounds(i).high;
  return all;
}

TEST(RayCaster, AnAddedObjectWidensBoundsAsIfItHadAlwaysBeenThere) {
  scene::Scene scene = room();
  Progress progress;
  RayCaster caster(scene, progress);
  const RayCaster first(scene, progress);
  const uint32_t added = scene.add_object(sliver());
  caster.update_object(scene, added);
  EXPECT_GT(caster.margin(), first.margin());
  EXPECT_TRUE(same(caster, RayCaster(scene, progress), 3));
  scene.objects[added].present = false;
  caster.update_object(scene, added);
  EXPECT_TRUE(same(caster, RayCaster(scene, progress), 3));
  caster.drop_objects(added);
  EXPECT_TRUE(same(caster, first, 2));
}

TEST(RayCaster, WhatIsInsideDoesNotDependOnOtherObjects) {
  scene::Scene scene = room();
  scene.objects[1].pose.translation = {0.1, 0.2, 0.7};
  Progress progress;
  RayCaster caster(scene, progress);
  const auto inside = [&] {
    std::vector<Stretch> found;
    for (int i = 0; i < 200; ++i) {
      const float angle = 0.03f * float(i);
      caster.add_inside(1, {-0.4f, 0.3f, 0.8f}, {std::cos(angle), 0, std::sin(angle)}, 2, found);
    }
    return found;
  };
  const std::vector<Stretch> before = inside();
  EXPECT_GT(before.size(), 5u);
  caster.update_object(scene, scene.add_object(sliver()));
  const std::vector<Stretch> after = inside();
  ASSERT_EQ(after.size(), before.size());
  for (size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].begin, before[i].begin);
    EXPECT_EQ(after[i].end, before[i].end);
  }
}

// An edit that computes everything anew keeps the old structures until it has succeeded.
TEST(RayCaster, WhatIsSavedMayOutliveIt) {
  const scene::Scene scene = room();
  Progress progress;
  mallopt(M_PERTURB, 0xa5);  // overwrites freed memory, so that its use crashes
  std::optional<RayCaster> caster(std::in_place, scene, progress);
  std::optional saved(caster->save_object(1));
  caster.reset();
  saved.reset();
  mallopt(M_PERTURB, 0);
}

}  // namespace
}  // namespace deltalux::trace
