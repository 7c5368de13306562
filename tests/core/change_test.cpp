// SPDX-License-Identifier: Apache-2.0
// What an edit touches: wherever an answer differs, the tests of its rays say so; and updates
// cast again little more than what that names.
#include "trace/change.h"

#include <gtest/gtest.h>

#include <functional>

#include "sectored.h"
#include "session_world.h"

namespace deltalux::trace {
namespace {

using session::Session;

scene::Scene room_with_lamps() {
  scene::Scene scene = session::room_with_spot();
  scene.lights[0].parameters = {0.05f, 0.1f};
  scene::PunctualLight sun = scene.lights[0], bulb = scene.lights[0];
  sun.kind = &lights::kind_named("sun"), sun.direction = {0.4f, -1, 0.2f}, sun.parameters = {};
  bulb.kind = &lights::kind_named("point"), bulb.position = {3, 2, 3.5}, bulb.parameters = {};
  scene.lights.insert(scene.lights.end(), {sun, bulb});
  // The box gets an arm, so that it has parts.
  direct::add_box(scene.objects[1], {0.3f, -0.3f, -0.05f}, {0.9f, -0.2f, 0.05f});
  scene.finish();
  return scene;
}

/// The room, its lights and its box before and after a move.
struct Moved {
  scene::Scene scene = room_with_lamps();
  Progress progress;
  RayCaster before{scene, progress}, after{scene, progress};
  std::vector<Light> lights = find_lights(scene);
  Change change;

  explicit Moved(const Pose& pose) {
    scene::Scene next = scene;
    next.objects[1].pose = pose;
    after.update_object(next, 1);
    std::vector<Box> parts = before.part_bounds(1);
    for (const Box& part : after.part_bounds(1)) parts.push_back(part);
    change.objects = {{1,
                       {before.object_bounds(1), after.object_bounds(1)},
                       after.object_bounds(1),
                       parts,
                       after.part_bounds(1)}};
    change.lights.assign(lights.size(), 0);
  }
  /// The change without the parts.
  Change coarse() const {
    Change out = change;
    out.objects[0].parts.clear(), out.objects[0].parts_now.clear();
    return out;
  }
};

Vec3f in_room(const PathRandom& random, uint32_t k) {
  return {0.05f + 3.9f * random(k, 0), 0.05f + 2.9f * random(k, 1), 0.05f + 3.9f * random(k, 2)};
}

TEST(ChangeTest, NamesAllThatDiffersAndLittleElse) {
  size_t differing = 0, named = 0, by_boxes = 0, all = 0;
  for (uint32_t round = 0; round < 20; ++round) {
    const PathRandom place(11, round);
    const Moved moved(session::at(0.5 + 3 * double(place(0, 0)), 0.5 + 3 * double(place(0, 1))));
    ASSERT_GT(moved.after.part_bounds(1).size(), 1u);
    const Change coarse = moved.coarse();
    const ChangeTest test(moved.change, moved.lights, shadow_slack(moved.after)),
        boxes(coarse, moved.lights, shadow_slack(moved.after));
    EXPECT_TRUE(test.moves(1));
    EXPECT_FALSE(test.moves(0));
    for (uint32_t i = 0; i < 400; ++i) {
      const PathRandom random(round, i);
      // A path of two segments that asks each light at its middle, and one of them at its end.
      const Vec3f a = in_room(random, 0), b = in_room(random, 1), c = in_room(random, 2);
      bool differs = false;
      for (const auto& [from, to] : {std::pair{a, b}, std::pair{b, c}})
        differs |=
            moved.before.occluded(from, to - from, 1) != moved.after.occluded(from, to - from, 1);
      const uint32_t at_end = i % uint32_t(moved.lights.size());
      for (uint32_t l = 0; l < moved.lights.size(); ++l)
        for (const Vec3f& p : {b, c}) {
          if (p == c && l != at_end) continue;
          const auto shape = direct::shape_of(moved.lights[l], l, 1);
          // of all sides
          for (const Vec3f& n : {Vec3f{0, 1, 0}, Vec3f{0, -1, 0}, Vec3f{1, 0, 0}, Vec3f{-1, 0, 0}})
            for (uint32_t k = 0; k < 4; ++k) {
              const auto ray = shape->glance({p, n}, random(k, 5), random(k, 6));
              differs |=
                  ray.irradiance > 0 && moved.before.occluded(ray.origin, ray.direction, ray.to) !=
                                            moved.after.occluded(ray.origin, ray.direction, ray.to);
            }
        }
      const auto touched = [&](const ChangeTest& by) {
        bool any = by.touches(a, b) || by.touches(b, c) || by.touches_light(at_end, c);
        for (uint32_t l = 0; l < moved.lights.size(); ++l) any |= by.touches_light(l, b);
        return any;
      };
      ASSERT_TRUE(touched(test) || !differs) << round << " " << i;
      ASSERT_TRUE(touched(boxes) || !touched(test)) << round << " " << i;
      differing += differs, named += touched(test), by_boxes += touched(boxes), ++all;
      // What a point may differ in, a box around it may, too.
      const Box around{b - Vec3f{0.1f, 0.2f, 0.1f}, b + Vec3f{0.1f, 0.1f, 0.2f}};
      EXPECT_TRUE(test.touches(around) || !test.touches(Box{b, b}));
      for (uint32_t l = 0; l < moved.lights.size(); ++l)
        EXPECT_TRUE(test.shades(l, around) || !test.shades(l, b));
    }
  }
  EXPECT_GT(differing, all / 20);
  EXPECT_LT(named, all * 9 / 10);
  EXPECT_LT(named, by_boxes * 19 / 20);
}

TEST(ShadowVolume, BoundsHoldAllOfItAndLittleElse) {
  double of_all = 0;
  for (uint32_t round = 0; round < 60; ++round) {
    const PathRandom random(7, round);
    scene::Scene scene = session::room_with_spot();
    scene::PunctualLight& light = scene.lights[0];
    light.kind = &lights::kind_named(round % 2 ? "sun" : "point"), light.parameters = {};
    light.direction = {random(0, 0) - 0.5f, -1, random(0, 1) - 0.5f};
    light.position = Vec3d(in_room(random, 1));
    scene.finish();
    const Vec3f low = in_room(random, 2), size{random(3, 0), random(3, 1), random(3, 2)};
    const ShadowVolume volume(find_lights(scene)[0], Box{low, low + size * 0.3f}, 1e-5f);
    const Box space{{0, 0, 0}, {4, 3, 4}}, bounds = volume.bounds(space);
    EXPECT_TRUE(space.contains(bounds));
    for (uint32_t i = 0; i < 2000; ++i) {
      const Vec3f p = in_room(PathRandom(round, i), 4);
      EXPECT_TRUE(!volume.contains(p) || bounds.overlaps(Box{p, p})) << round;
    }
    const Vec3f e = bounds.extent();
    of_all += double(e.x * e.y * e.z) / 48;
  }
  EXPECT_LT(of_all / 60, 0.4);  // rooms without shadows count, too
}

TEST(ShadowVolume, OfNothingHasNoBounds) {
  const Moved moved(session::at(2.5, 2));
  EXPECT_TRUE(ShadowVolume(moved.lights[1], Box{}, 0).bounds({{0, 0, 0}, {4, 3, 4}}).empty());
}

TEST(ChangeTest, KnowsLampsThatSendOtherLight) {
  const Moved moved(session::at(2.5, 2));
  Change change = moved.change;
  change.lights[2] = 1;
  const ChangeTest test(change, moved.lights, 0);
  EXPECT_TRUE(test.touches_light(2, Vec3f{100, 100, 100}));
  EXPECT_FALSE(test.touches_light(1, Vec3f{100, 100, 100}));
  // A lamp's cone that what moved does not meet throws no shadow of it.
  const ShadowVolume away(moved.lights[0], Box{{3.5f, 0, 3.5f}, {3.9f, 1, 3.9f}}, 1e-5f);
  EXPECT_FALSE(away.contains({3.7f, 0, 3.7f}));
  const ShadowVolume below(moved.lights[0], Box{{1.9f, 1, 1.9f}, {2.3f, 1.4f, 2.3f}}, 1e-5f);
  EXPECT_TRUE(below.contains({2.2f, 0, 2.1f}));
}

/// The box carries a lamp whose light depends on how it is turned about its direction.
scene::Scene room_with_sectors() {
  scene::Scene scene = session::room_with_spot();
  scene::PunctualLight& lamp = scene.lights[0];
  lamp.kind = &lights::sectored();
  lamp.position = {0, 1.5, 0}, lamp.direction = {0, -1, 0}, lamp.attached = 1;
  lamp.parameters = {1, 0, 0, 1, 0.1f, 0.6f, 0.1f, 0.3f};
  scene.finish();
  return scene;
}

Pose turned(double cosine, double sine) {
  Pose pose = session::at(1, 1);
  pose.row[0] = {cosine, 0, sine}, pose.row[2] = {-sine, 0, cosine};
  return pose;
}

std::vector<double> light_of(const Session& session) {
  std::vector<double> light(3 * session.state().samples.size());
  session.read_irradiance(light.data());
  return light;
}

TEST(Change, LampsThatTurnAboutTheirDirectionSendOtherLight) {
  for (const session::Options& chosen :
       {session::options(1, session::DirectMode::paths, segments::SegmentEnd::first),
        session::options(2, session::DirectMode::sampled, segments::SegmentEnd::bounded),
        session::gathering(1)}) {
    Progress progress;
    Session session(room_with_sectors(), session::some_samples(), chosen);
    session.bake(progress);
    if (chosen.gather_rays) {
      EXPECT_EQ(session.state().rays.guiding.beams.size(), 1u);
    }
    const std::vector<double> first = light_of(session);
    std::vector<std::array<uint64_t, 4>> digests{session.digest()};
    for (const Pose& pose : {turned(0.6, 0.8), turned(0, 1), turned(1, 0)}) {
      session.update(std::vector<scene::Edit>{scene::Move{1, pose}}, 0, progress);
      const std::vector<double> updated = light_of(session);
      digests.push_back(session.digest());
      session.recompute(progress);
      EXPECT_EQ(session.digest(), digests.back());
      EXPECT_EQ(light_of(session), updated);
    }
    EXPECT_EQ(digests.front(), digests.back());
    EXPECT_EQ(light_of(session), first);
    EXPECT_NE(digests[1], digests[0]);
    EXPECT_NE(digests[2], digests[1]);
  }
}

TEST(Change, SpotsThatTurnAboutTheirDirectionSendTheSame) {
  scene::Scene scene = session::room_with_spot();
  scene.lights[0].position = {0, 1.5, 0}, scene.lights[0].direction = {0, -1, 0};
  scene.lights[0].attached = 1;
  scene.finish();
  Light light = find_lights(scene)[0], again = light;
  scene.objects[1].pose = turned(0.6, 0.8);
  place_light(scene, again);
  EXPECT_TRUE(sends_alike(light, again));
  scene.objects[1].present = false;
  place_light(scene, again);
  EXPECT_FALSE(sends_alike(light, again));
}

TEST(Change, RaysAreCastAgainWhereSomethingMovedAlone) {
  Progress progress;
  session::Options chosen = session::gathering(1);
  chosen.gather_rays = 256;
  Session session(session::room(), session::some_samples(), chosen);
  session.bake(progress);
  const uint64_t all = session.state().rays.hits.rays().all();
  const auto frame = [&](const scene::Edit& edit) {
    return session.update(std::vector<scene::Edit>{edit}, 0, progress);
  };
  // Factors are applied where light is read.
  EXPECT_EQ(frame(scene::Dim{0, 0.5}).gathered_rays, 0u);
  EXPECT_EQ(frame(scene::SetReflectance{0, {0.3f, 0.4f, 0.5f}}).gathered_rays, 0u);
  // Of four samples on the box, all rays; of the others, 5 in a hundred.
  const session::Frame moved = frame(scene::Move{1, session::at(1.01, 1)});
  EXPECT_GE(moved.gathered_rays, 4u * 256);
  EXPECT_LT(moved.gathered_rays - 4u * 256, all / 10);
  EXPECT_LE(moved.changed_rays, moved.gathered_rays);
  EXPECT_GT(moved.changed_rays, 0u);
  // Nothing moved: everything that is asked again answers as before.
  EXPECT_EQ(frame(scene::Move{1, session::at(1.01, 1)}).gathered_rays, 0u);
}

/// Samples along the foot or the top of two walls, whose rays often begin chains.
samples::SampleSet along_walls(float height, float facing) {
  samples::SampleSet set;
  for (int i = 0; i < 32; ++i) {
    const float along = 0.1f + 0.1f * float(i);
    set.point.push_back(i % 2 ? Vec3f{along, height, 0.03f} : Vec3f{0.03f, height, along});
    set.normal.push_back({0, facing, 0});
    set.attached.push_back(scene::kNone);
  }
  set.radius.assign(set.point.size(), 0.2f);
  return set;
}

/// The room with a lamp that shines down at a height of 2, and more lamps in its group.
scene::Scene room_with_lamp(uint32_t more) {
  scene::Scene scene = session::room();
  scene.objects.push_back(session::second_lamp());
  scene::PunctualLight bulb{};
  bulb.kind = &lights::kind_named("point");
  bulb.intensity = {1, 1, 1};
  for (uint32_t i = 0; i < more; ++i) {
    bulb.position = {0.3f + 0.4f * float(i % 9), 2.5f, 0.3f + 0.4f * float(i / 9)};
    scene.lights.push_back(bulb);
  }
  scene.finish();
  return scene;
}

TEST(Change, ChainsAskAgainWhereALampThatMovedShinesAndAreNotCast) {
  const scene::Scene scene = room_with_lamp(0);
  Progress progress;
  const auto again = [&](const samples::SampleSet& samples, const scene::Edit& edit) {
    Session session(scene, samples, session::gathering(1));
    session.bake(progress);
    const session::Frame frame = session.update(std::vector<scene::Edit>{edit}, 0, progress);
    const std::array<uint64_t, 4> updated = session.digest();
    const std::vector<double> light = light_of(session);
    session.recompute(progress);
    EXPECT_EQ(session.digest(), updated);
    EXPECT_EQ(light_of(session), light);
    return double(frame.gathered_rays) / double(session.state().rays.hits.rays().all());
  };
  Pose aside = scene.objects[2].pose, turned = aside;
  aside.translation.x += 0.1;
  turned.row[0] = {-1, 0, 0}, turned.row[1] = {0, -1, 0};  // it shines up
  const auto at_ceiling = along_walls(2.999f, -1), on_floor = along_walls(0.001f, 1);
  // Behind the lamp nothing asks again. Where it shines, other lamps have other chances, but only
  // what asks it, or now another one, casts rays.
  EXPECT_LT(again(at_ceiling, scene::Move{2, aside}), 0.01);
  const auto few = [](double share) { return share > 0.01 && share < 0.2; };
  EXPECT_PRED1(few, again(on_floor, scene::Move{2, aside}));
  EXPECT_GT(again(at_ceiling, scene::Move{2, turned}), 0.3);  // there, most ask it now
  EXPECT_PRED1(few, again(on_floor, scene::SetPresent{2, false}));
}

TEST(Change, OfManyLampsOneConcernsAllPlaces) {
  // A group of more than 64 has a tree of them, by whose nodes all places choose.
  Progress progress;
  const scene::Scene scene = room_with_lamp(70);
  Session session(scene, along_walls(2.999f, -1), session::gathering(1));
  session.bake(progress);
  Pose aside = scene.objects[2].pose;
  aside.translation.x += 0.5;
  session.update(std::vector<scene::Edit>{scene::Move{2, aside}}, 0, progress);
  const std::vector<double> updated = light_of(session);
  session.recompute(progress);
  EXPECT_EQ(light_of(session), updated);
}

TEST(Change, LampsThatMovedWhileRaysWaitedCountWhereTheyWere) {
  // In between, the lamp shines up, and some of the rays know it there.
  const scene::Scene scene = room_with_lamp(0);
  Pose up = scene.objects[2].pose, aside = up;
  up.row[0] = {-1, 0, 0}, up.row[1] = {0, -1, 0};
  aside.translation.x += 0.5;
  size_t waited = 0;
  for (const double budget_ms : {1e-6, 0.3, 1.0, 3.0}) {
    Progress progress;
    Session session(scene, along_walls(2.999f, -1), session::gathering(1));
    session.bake(progress);
    const auto update = [&](const Pose& pose, double budget) {
      return session.update(std::vector<scene::Edit>{scene::Move{2, pose}}, budget, progress);
    };
    waited += update(up, budget_ms).done < 1;
    update(aside, 0);
    const std::vector<double> updated = light_of(session);
    session.recompute(progress);
    EXPECT_EQ(light_of(session), updated);
  }
  EXPECT_GT(waited, 0u);
}

TEST(Change, KeepsLampsOfEarlierChanges) {
  const scene::Scene scene = room_with_lamps();
  const std::vector<Light> lights = find_lights(scene);
  Change first, second;
  first.lights = {1}, first.before = {lights[0]};
  second.lights = {0, 1}, second.before = {lights[1]};
  first.merge(second);
  EXPECT_EQ(first.lights, (std::vector<uint8_t>{1, 1}));
  ASSERT_EQ(first.before.size(), 2u);
  EXPECT_TRUE(sends_alike(first.before[0], lights[0]) && sends_alike(first.before[1], lights[1]));
  for (size_t i = 0; i < 2 * Change::kMaxBefore; ++i) first.merge(second);
  EXPECT_EQ(first.before.size(), Change::kMaxBefore + 1);  // one more tells that some are missing
}

TEST(LightShape, MayLightWhereverItGivesSomething) {
  scene::Scene scene = session::room_with_spot();
  scene.objects.push_back(session::second_lamp());
  direct::add_quad(scene.objects[2], {-0.2f, 0.2f, -0.2f}, {0, 0.1f, 0}, {0.4f, 0, 0}, 1);
  scene.finish();
  size_t dark = 0;
  for (const Light& light : find_lights(scene)) {
    const auto shape = direct::shape_of(light, 0, 1);
    for (uint32_t i = 0; i < 4000; ++i) {
      const auto r = sobol::sample(i, 3), q = sobol::sample(i, 4);
      const Vec3f low{4 * r[0], 3 * r[1], 4 * r[2]}, size{q[0], q[1], q[2]};
      const Box box{low, low + size * (r[3] * r[3])};
      const bool may = shape->may_light(box);
      dark += !may;
      for (uint32_t k = 0; k < 16 && !may; ++k) {
        const auto p = sobol::sample(k, i), n = sobol::sample(k, i + 1);
        const Vec3f extent = box.extent();
        const direct::Receiver at{
            box.low + Vec3f{extent.x * p[0], extent.y * p[1], extent.z * p[2]},
            normalize(Vec3f{n[0] - 0.5f, n[1] - 0.5f, n[2] - 0.5f}), scene::kNone, 0};
        ASSERT_EQ(shape->about(at), 0) << i;
        ASSERT_EQ(shape->open(at), 0) << i;
      }
    }
  }
  EXPECT_GT(dark, 3000u);
}

}  // namespace
}  // namespace deltalux::trace
