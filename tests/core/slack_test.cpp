// SPDX-License-Identifier: Apache-2.0
// Lengths that follow what is near: rays off surfaces, insides of bodies, paths of light groups.
#include <gtest/gtest.h>

#include <cmath>

#include "base/random.h"
#include "session_world.h"
#include "trace/scatter.h"

namespace deltalux::session {
namespace {

/// Steps of diffuse walks inside a closed box, turned and moved off zero, that got out of it. The
/// turned box has the sliver triangles and tilted planes that make rounding worst.
uint64_t escapes(float size, double away, float turn) {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}};
  scene::Object walls;
  direct::add_box(walls, Vec3f{1, 0.5f, 1} * size, Vec3f{-1, -0.5f, -1} * size);
  for (Vec3f& v : walls.vertices) {
    const Vec3d p(v);
    const double c = std::cos(turn), s = std::sin(turn);
    const Vec3d q{c * p.x - s * p.y, s * p.x + c * p.y, p.z};
    v = Vec3f(Vec3d{c * q.x - s * q.z + away, q.y, s * q.x + c * q.z - away});
  }
  scene.objects = {walls};
  scene.finish();
  Progress progress;
  const trace::RayCaster caster(scene, progress);
  uint64_t lost = 0;
  for (uint32_t walk = 0; walk < 500; ++walk) {
    Vec3f at{float(away), 0, float(-away)}, w = normalize(Vec3f{0.3f, 0.5f, -0.4f});
    const PathRandom random(7, walk);
    for (uint32_t bounce = 0; bounce < 100; ++bounce) {
      const trace::Hit hit = caster.closest(at, w);
      if (!hit.valid()) {
        ++lost;
        break;
      }
      const Vec3f n = trace::facing_normal(hit, w);
      at = trace::leave_surface(at, w, hit, n, scene.slack_of(hit.primitive));
      Vec3f u, v;
      tangent_frame(n, u, v);
      const float turn_by = 6.2831853f * random(bounce, 0), flat = std::sqrt(random(bounce, 1));
      w = u * (flat * std::cos(turn_by)) + v * (flat * std::sin(turn_by)) +
          n * std::sqrt(1 - flat * flat);
    }
  }
  return lost;
}

TEST(Slack, NoWalkLeavesAClosedBox) {
  for (const float turn : {0.0f, 0.3f, 1.1f})
    for (const float size : {1e-3f, 1.0f, 1e3f})
      for (const double away : {0.0, 10.0, 1000.0})
        // Nearer than single precision holds the box together.
        if (away <= 1e4 * size) {
          EXPECT_EQ(escapes(size, away, turn), 0u) << size << " m, " << away << " m off, " << turn;
        }
}

TEST(Slack, FollowsWhatIsNear) {
  EXPECT_LT(position_slack({3, 1, -2}), 1e-5f);
  scene::Scene scene = room();
  scene::Object lawn;
  direct::add_quad(lawn, {-5000, -1, -5000}, {0, 0, 10000}, {10000, 0, 0});
  scene.objects.insert(scene.objects.begin(), lawn);
  scene.finish();
  for (uint32_t i = 2; i < scene.primitives(); ++i) EXPECT_LT(scene.slack_of(i), 1e-5f) << i;
}

/// The part of a line along x that is inside `object`, in metres.
float inside(const scene::Object& object, Vec3f from, float to) {
  scene::Scene scene;
  scene.materials = {{{0.5f, 0.5f, 0.5f}, {}, false}};
  scene.objects = {object};
  scene.finish();
  Progress progress;
  const trace::RayCaster caster(scene, progress);
  std::vector<trace::Stretch> found;
  caster.add_inside(0, from, {1, 0, 0}, to, found);
  float sum = 0;
  for (const trace::Stretch& piece : found) sum += piece.end - piece.begin;
  return sum;
}

scene::Object bodies(std::initializer_list<std::array<float, 2>> along_x) {
  scene::Object object;
  object.name = "bodies";
  object.movable = true;
  for (const auto& [low, high] : along_x) direct::add_box(object, {low, 0, 0}, {high, 1, 1});
  return object;
}

TEST(Inside, CountsUnions) {
  // Along a diagonal of the end faces as well: lines through edges.
  for (const Vec3f from : {Vec3f{-1, 0.3f, 0.4f}, Vec3f{-1, 0.5f, 0.5f}}) {
    EXPECT_NEAR(inside(bodies({{0, 2}}), from, 10), 2, 1e-5);
    EXPECT_NEAR(inside(bodies({{0, 1}, {1, 2}}), from, 10), 2, 1e-5);       // touching
    EXPECT_NEAR(inside(bodies({{0, 1.5f}, {1, 2}}), from, 10), 2, 1e-5);    // overlapping
    EXPECT_NEAR(inside(bodies({{0, 2}, {0.5f, 1}}), from, 10), 2, 1e-5);    // nested
    EXPECT_NEAR(inside(bodies({{0, 1}, {3, 4}}), from, 4.5f), 1.5f, 1e-5);  // apart, cut off
  }
  EXPECT_NEAR(inside(bodies({{0, 2}}), {0.5f, 0.3f, 0.4f}, 10), 1.5f, 1e-5);  // from within
}

TEST(Inside, OpenBodiesHaveNone) {
  scene::Object open = bodies({{0, 1}});
  open.triangles.pop_back(), open.material.pop_back(), open.group.pop_back();
  EXPECT_FALSE(scene::is_closed(open));
  EXPECT_EQ(inside(open, {-1, 0.3f, 0.4f}, 10), 0);
  // Four faces on one edge: boxes that share it are closed.
  scene::Object two = bodies({{0, 1}});
  direct::add_box(two, {1, 1, 0}, {2, 2, 1});
  EXPECT_TRUE(scene::is_closed(two));
}

TEST(RayCaster, RaysThatCannotBeTracedMeetNothing) {
  Progress progress;
  const trace::RayCaster caster(room(), progress);
  const float nan = std::nanf(""), far = 1e30f;
  const Vec3f in{2, 1, 2}, down{0, -1, 0};
  for (const Vec3f bad : {Vec3f{nan, 0, 0}, Vec3f{0, far, 0}, Vec3f{0, 0, -INFINITY}}) {
    EXPECT_FALSE(caster.closest(bad, down).valid());
    EXPECT_FALSE(caster.closest(in, bad).valid() && bad.y != far);
    EXPECT_FALSE(caster.occluded_static(bad, down, 1));
    trace::RayFan fan;
    fan.origin = bad;
    fan.count = 1;
    fan.x[0] = 0, fan.y[0] = -1, fan.z[0] = 0;
    EXPECT_EQ(caster.occluded_static(fan, {1, 0, 0, 0}), trace::RayBits{});
  }
  EXPECT_FALSE(caster.closest(in, {0, 0, 0}).valid());
  EXPECT_FALSE(caster.closest(in, down, nan, nan).valid());
}

TEST(Allotment, EachGroupKeepsAFloor) {
  std::vector<trace::Light> lights(3);
  lights[0].group = 0, lights[1].group = 1, lights[2].group = 1;
  const std::vector<double> shares = {1e6, 1, 3};
  trace::allot_paths(lights, shares, 800'000, kBatches);
  EXPECT_EQ(lights[0].path_count + lights[1].path_count + lights[2].path_count, 800'000u);
  EXPECT_NEAR(double(lights[1].path_count), 25'000, 16);
  EXPECT_NEAR(double(lights[2].path_count), 75'000, 16);
  // Groups above the floor keep their proportions.
  const std::vector<double> even = {2, 1, 1};
  trace::allot_paths(lights, even, 800'000, kBatches);
  EXPECT_EQ(lights[0].path_count, 400'000u);
}

}  // namespace
}  // namespace deltalux::session
