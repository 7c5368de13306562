// SPDX-License-Identifier: Apache-2.0
// Direct light under edits: update == compute to the bit, for any threads, cancelled or not, saved
// or not. Shadow volumes against single rays.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <cstring>
#include <random>
#include <thread>

#include "base/error.h"
#include "direct/view_code.h"
#include "direct_world.h"
#include "lights/kinds.h"
#include "memory_archive.h"
#include "trace/shadow_volume.h"

namespace deltalux::direct {
namespace {

using Random = std::mt19937;

float uniform(Random& random, float low, float high) {
  return std::uniform_real_distribution<float>(low, high)(random);
}

Vec3f uniform_point(Random& random, Vec3f low, Vec3f high) {
  return {uniform(random, low.x, high.x), uniform(random, low.y, high.y),
          uniform(random, low.z, high.z)};
}

/// A furnished room without ceiling and nine lights in three groups; objects 1 to 3 move. Object 2
/// is a lamp with a bulb and samples of its own, object 3 carries a spot light.
struct Room : World {
  std::vector<Receiver> local;     // per sample, in its object's space
  std::vector<uint32_t> attached;  // per sample, object or kNone
  std::vector<bool> there;         // per object

  explicit Room(uint32_t seed, size_t samples = 500) {
    Random random(seed);
    scene.group_count = 3;
    scene::Object room;
    room.name = "room";
    add_quad(room, {-4, 0, -3}, {0, 0, 6}, {8, 0, 0});
    add_quad(room, {-4, 0, -3}, {0, 3, 0}, {0, 0, 6});
    add_quad(room, {4, 0, -3}, {0, 0, 6}, {0, 3, 0});
    add_quad(room, {-4, 0, -3}, {8, 0, 0}, {0, 3, 0});
    for (int i = 0; i < 12; ++i) {
      const Vec3f low = uniform_point(random, {-3.8f, 0, -2.8f}, {3, 1, 2});
      add_box(room, low, low + uniform_point(random, {0.1f, 0.1f, 0.1f}, {0.8f, 0.8f, 0.8f}));
    }
    add_quad(room, {-2, 2.99f, -0.3f}, {1.2f, 0, 0}, {0, 0, 0.6f}, 1);
    add_quad(room, {1, 2.99f, -0.3f}, {1.2f, 0, 0}, {0, 0, 0.6f}, 1, 3, 1);
    add_quad(room, {-3.99f, 0.5f, -1}, {0, 2, 0}, {0, 0, 2}, 1);  // a window, large when near
    scene::Object chair = movable("chair");
    add_box(chair, {-0.3f, 0.4f, -0.3f}, {0.3f, 0.45f, 0.3f});
    add_box(chair, {-0.3f, 0.45f, 0.25f}, {0.3f, 1.0f, 0.3f});
    add_box(chair, {-0.05f, 0.01f, -0.05f}, {0.05f, 0.4f, 0.05f});
    scene::Object lamp = movable("lamp");
    add_box(lamp, {-0.2f, 0.6f, -0.2f}, {0.2f, 0.61f, 0.2f});
    add_quad(lamp, {-0.1f, 0.59f, -0.1f}, {0.2f, 0, 0}, {0, 0, 0.2f}, 1, 1, 2);
    add_quad(lamp, {-0.1f, 0.7f, -0.1f}, {0, 0, 0.2f}, {0.2f, 0, 0}, 2, 1, 2);
    scene::Object stand = movable("stand");
    add_box(stand, {-0.1f, 0.01f, -0.1f}, {0.1f, 1.2f, 0.1f});
    scene.objects = {room, chair, lamp, stand};
    scene::PunctualLight bulb;
    bulb.kind = &lights::kind_named("point");
    bulb.position = {0, 2.5, 2};
    bulb.intensity = {3, 3, 3};
    scene::PunctualLight spot = bulb;
    spot.kind = &lights::kind_named("spot");
    spot.position = {0, 1.3, 0};
    spot.direction = {0.5, -1, 0.2};
    spot.parameters = {0, 0.7f};
    spot.attached = 3;
    scene::PunctualLight sun = bulb;
    sun.kind = &lights::kind_named("sun");
    sun.direction = {0.3, -1, 0.1};
    scene.lights = {bulb, spot, sun};
    there.assign(4, true);
    finish();
    for (size_t i = 0; i < samples; ++i) {
      attached.push_back(i % 6 == 0 ? 2u : scene::kNone);
      const Vec3f p =
          attached[i] == 2
              ? Vec3f{uniform(random, -0.2f, 0.2f), 0.615f, uniform(random, -0.2f, 0.2f)}
              : uniform_point(random, {-3.9f, 0.01f, -2.9f}, {3.9f, 1, 2.9f});
      const Vec3f n = uniform_point(random, {-1, -0.2f, -1}, {1, 1, 1});
      local.push_back({p, attached[i] == 2 ? Vec3f{0, 1, 0} : normalize(n)});
    }
    receivers.resize(samples);
    for (uint32_t i = 0; i < samples; ++i) place(i);
  }
  static scene::Object movable(const char* name) {
    scene::Object object;
    object.name = name;
    object.movable = true;
    return object;
  }
  void place(uint32_t i) {
    if (attached[i] == scene::kNone) {
      receivers[i] = local[i];
      return;
    }
    const scene::Object& object = scene.objects[attached[i]];
    receivers[i] = object.present ? Receiver{object.pose.point(local[i].point),
                                             object.pose.direction(local[i].normal), attached[i]}
                                  : Receiver{};
  }
  /// Gives `object` a pose and presence and adds what that changes to `change`.
  void edit(uint32_t object, const Pose& pose, bool present, DirectChange& change) {
    change.boxes.push_back(caster->object_bounds(object));
    scene.objects[object].pose = pose;
    scene.objects[object].present = present;
    caster->update_object(scene, object);
    change.boxes.push_back(caster->object_bounds(object));
    for (uint32_t i = 0; i < lights.size(); ++i)
      if (lights[i].object == object) {
        trace::place_light(scene, lights[i]);
        change.lights.push_back(i);
      }
    for (uint32_t i = 0; i < receivers.size(); ++i)
      if (attached[i] == object) {
        place(i);
        change.samples.push_back(i);
      }
  }
  Pose random_pose(Random& random) const {
    Pose pose;
    const double angle = uniform(random, 0, 6.28f), c = std::cos(angle), s = std::sin(angle);
    pose.row[0] = {c, 0, s};
    pose.row[2] = {-s, 0, c};
    pose.translation = Vec3d(uniform_point(random, {-3.5f, 0, -2.5f}, {3.5f, 0.5f, 2.5f}));
    return pose;
  }
  void random_edit(Random& random, DirectChange& change) {
    const uint32_t object = 1 + random() % 3;
    const bool present = random() % 4 != 0;
    edit(object, random() % 5 ? random_pose(random) : scene.objects[object].pose, present, change);
  }
  /// A new movable with a light of its own.
  void insert(Random& random, DirectChange& change) {
    scene::Object box = movable("insert");
    add_box(box, {0, 0, 0}, {0.3f, 0.5f, 0.3f});
    add_quad(box, {0, 0.6f, 0}, {0.2f, 0, 0}, {0, 0, 0.2f}, 1, 1, 2);
    box.pose = random_pose(random);
    const uint32_t object = scene.add_object(box);
    caster->update_object(scene, object);
    change.boxes.push_back(caster->object_bounds(object));
    for (const trace::Light& light : trace::find_lights(scene, object)) {
      change.lights.push_back(uint32_t(lights.size()));
      lights.push_back(light);
      sampled.push_back(1);
    }
  }
};

std::vector<int64_t> sums_of(const DirectLight& direct) {
  return {direct.sums().begin(), direct.sums().end()};
}

void expect_compute_after_every_edit(uint32_t first_seed, uint32_t end_seed) {
  for (uint32_t seed = first_seed; seed < end_seed; ++seed) {
    Room room(seed);
    ASSERT_EQ(room.lights.size(), 9u);
    room.sampled[seed % 9] = 0;  // one light is left to the paths
    Random random(100 + seed);
    DirectLight direct = room.compute();
    const std::vector<int64_t> first = sums_of(direct);
    size_t changed = 0;
    for (int step = 0; step < 8; ++step) {
      const std::vector<int64_t> before = sums_of(direct);
      DirectChange change;
      for (uint32_t k = 0; k < 1 + random() % 2; ++k) room.random_edit(random, change);
      if (step == 4) room.insert(random, change);
      direct.update(room.context(), change, Workers(1), room.progress);
      ASSERT_EQ(sums_of(direct), sums_of(room.compute())) << "seed " << seed << ", step " << step;
      changed += before != sums_of(direct);
    }
    EXPECT_GE(changed, 4u);
    // Back to where everything stood.
    DirectChange back;
    for (uint32_t object = 1; object < room.scene.objects.size(); ++object)
      room.edit(object, {}, object < 4, back);
    direct.update(room.context(), back, Workers(1), room.progress);
    ASSERT_EQ(sums_of(direct), first);
  }
}

TEST(DirectUpdate, EqualsComputeAfterEveryEdit) { expect_compute_after_every_edit(0, 2); }

TEST(DirectUpdate, EqualsComputeAfterEveryEditSlow) { expect_compute_after_every_edit(2, 12); }

void expect_turns_under_a_budget(uint32_t first_seed, uint32_t end_seed) {
  for (uint32_t seed = first_seed; seed < end_seed; ++seed) {
    Room room(seed);
    room.sampled[seed % 9] = 0;
    Random random(200 + seed);
    DirectLight direct = room.compute();
    size_t behind = 0;
    for (int step = 0; step < 30; ++step) {
      DirectChange change;
      if (random() % 4) room.random_edit(random, change);
      if (step == 7 || step == 8) room.insert(random, change);
      // A billionth of a millisecond: one light at a time.
      direct.update(room.context(), change, Workers(1), room.progress, random() % 8 ? 1e-9 : 0);
      if (direct.current_share() == 1)
        ASSERT_EQ(sums_of(direct), sums_of(room.compute())) << "seed " << seed << ", step " << step;
      else
        ++behind;
      if (step == 20) {  // a snapshot in the middle
        ArchiveView view;
        direct.save(view);
        MemoryArchive archive(view);
        DirectLight opened(room.receivers.size(), {kQuantum}, 1);
        opened.restore(archive, room.lights, room.sampled);
        ASSERT_EQ(sums_of(opened), sums_of(direct));
        ASSERT_EQ(opened.current_share(), direct.current_share());
        direct = std::move(opened);
      }
    }
    EXPECT_GT(behind, 10u);
    // Every light has its turn within as many updates as there are lights.
    size_t calls = 0;
    for (; direct.current_share() < 1; ++calls)
      direct.update(room.context(), {}, Workers(1), room.progress, 1e-9);
    EXPECT_LE(calls, room.lights.size());
    ASSERT_EQ(sums_of(direct), sums_of(room.compute())) << "seed " << seed;
  }
}

TEST(DirectUpdate, LightsTakeTurnsUnderABudgetAndCatchUp) { expect_turns_under_a_budget(0, 2); }

TEST(DirectUpdate, LightsTakeTurnsUnderABudgetAndCatchUpSlow) {
  expect_turns_under_a_budget(2, 12);
}

TEST(DirectUpdate, EveryLightHasItsTurnWhileChangesGoOn) {
  for (uint32_t seed = 0; seed < 6; ++seed) {
    Room room(seed);
    Random random(300 + seed);
    DirectLight direct = room.compute();
    DirectChange change;
    room.edit(2, room.random_pose(random), true, change);
    const std::vector<int64_t> wanted = sums_of(room.compute());
    for (size_t k = 0; k < room.lights.size(); ++k) {
      ASSERT_NE(sums_of(direct), wanted);
      direct.update(room.context(), change, Workers(1), room.progress, 1e-9);
      ASSERT_LT(direct.current_share(), 1);
      change = {{}, {}, {0}};  // named again and again, but the same
    }
    ASSERT_EQ(sums_of(direct), wanted) << "seed " << seed;
  }
}

TEST(DirectUpdate, ThreadsDoNotMatter) {
  Room room(1);
  Random random(1);
  DirectLight one = room.compute(1), two = room.compute(2);
  ASSERT_EQ(sums_of(one), sums_of(two));
  for (int step = 0; step < 3; ++step) {
    DirectChange change;
    room.random_edit(random, change);
    one.update(room.context(), change, Workers(1), room.progress);
    two.update(room.context(), change, Workers(2), room.progress);
    ASSERT_EQ(sums_of(one), sums_of(two));
  }
}

TEST(DirectUpdate, AddingSamplesChangesNoOthers) {
  Room room(2);
  const std::vector<int64_t> some = sums_of(room.compute());
  const size_t samples = room.receivers.size();
  room.receivers.insert(room.receivers.begin(), 77, Receiver{{0, 0.5f, 0}, {0, 1, 0}});
  const std::vector<int64_t> more = sums_of(room.compute());
  const size_t parts = some.size() / (3 * samples);
  ASSERT_GE(parts, 3u);
  for (size_t part = 0; part < parts; ++part)
    for (size_t i = 0; i < 3 * samples; ++i)
      ASSERT_EQ(some[part * samples * 3 + i], more[(part * (samples + 77) + 77) * 3 + i]);
}

TEST(DirectUpdate, SeedMovesTheStrataOnly) {
  Room room(3);
  const std::vector<int64_t> a = sums_of(room.compute(1, 1)), b = sums_of(room.compute(1, 2));
  double sum_a = 0, sum_b = 0;
  for (size_t i = 0; i < a.size(); ++i) sum_a += double(a[i]), sum_b += double(b[i]);
  EXPECT_NE(a, b);
  EXPECT_NEAR(sum_a / sum_b, 1, 1e-3);
}

TEST(DirectUpdate, CancelLeavesEverythingAsItWas) {
  Room room(4, 5000);
  Random random(4);
  DirectLight direct = room.compute();
  const std::vector<int64_t> before = sums_of(direct);
  const size_t bytes = direct.bytes();
  DirectChange change;
  room.edit(2, room.random_pose(random), true, change);
  room.insert(random, change);
  // Cancelled half way, by another thread.
  for (int kind = 0; kind < 2; ++kind) {
    Progress progress;
    std::atomic<bool> finished = false;
    std::thread canceller([&] {
      while (progress.fraction() < 0.2 && !finished) std::this_thread::yield();
      progress.cancel();
    });
    const auto call = [&] {
      if (kind == 0)
        direct.update(room.context(), change, Workers(1), progress);
      else
        direct.compute(room.context(), Workers(2), progress);
    };
    EXPECT_THROW(call(), Cancelled);
    finished = true;
    canceller.join();
    ASSERT_EQ(sums_of(direct), before);
    ASSERT_EQ(direct.current_share(), 1);
    ASSERT_EQ(direct.bytes(), bytes);
  }
  direct.update(room.context(), change, Workers(1), room.progress);
  EXPECT_EQ(sums_of(direct), sums_of(room.compute()));
}

TEST(DirectUpdate, MemoryDoesNotGrowWithHistory) {
  Room room(8);
  Random random(8);
  DirectLight direct = room.compute();
  const size_t first = direct.bytes();
  for (int step = 0; step < 200; ++step) {
    DirectChange change;
    room.edit(2, room.random_pose(random), true, change);
    direct.update(room.context(), change, Workers(1), room.progress);
  }
  EXPECT_LT(direct.bytes(), first + first / 2);
}

TEST(DirectUpdate, SnapshotsCarryOn) {
  Room room(5);
  Random random(5);
  DirectLight direct = room.compute();
  for (int step = 0; step < 3; ++step) {
    DirectChange change;
    room.edit(2, room.random_pose(random), true, change);
    direct.update(room.context(), change, Workers(1), room.progress);
  }
  ArchiveView view;
  direct.save(view);
  const MemoryArchive saved(view);
  MemoryArchive archive = saved;
  DirectLight opened(room.receivers.size(), {kQuantum}, 1);
  opened.restore(archive, room.lights, room.sampled);
  ASSERT_EQ(sums_of(opened), sums_of(direct));
  DirectChange change;
  room.edit(1, room.random_pose(random), true, change);
  opened.update(room.context(), change, Workers(1), room.progress);
  EXPECT_EQ(sums_of(opened), sums_of(room.compute()));

  const std::vector<int64_t> before = sums_of(opened);
  const auto expect_refusal = [&](const char* what, const auto& damage) {
    MemoryArchive damaged = saved;
    damage(damaged.arrays);
    EXPECT_THROW(opened.restore(damaged, room.lights, room.sampled), FormatError) << what;
  };
  for (const auto& [name, bytes] : saved.arrays) {
    expect_refusal("cut", [&](auto& arrays) { arrays[name].resize(bytes.size() - 1); });
    expect_refusal("gone", [&](auto& arrays) { arrays.erase(name); });
  }
  const auto set = [&](const char* name, size_t entry, auto value) {
    expect_refusal(name, [&](auto& arrays) {
      ASSERT_GE(arrays[name].size(), (entry + 1) * sizeof value);
      std::memcpy(arrays[name].data() + entry * sizeof value, &value, sizeof value);
    });
  };
  set("direct.views", 0, uint32_t(1) << 30);      // a place that is not there
  set("direct.views", 0, uint32_t(0xfffffff3u));  // a kind that is not there
  set("direct.weights", 0, int64_t(-1));
  set("direct.weights", 0, int64_t(1) << 60);
  set("direct.behind", 0, uint8_t(2));
  set("direct.partial", 5, std::nan(""));  // the first one's share of the light
  set("direct.partial", 5, 1.5);
  expect_refusal("twice", [](auto& arrays) {
    auto* views = reinterpret_cast<uint32_t*>(arrays["direct.views"].data());
    const size_t count = arrays["direct.views"].size() / sizeof *views;
    ASSERT_GE(std::count_if(views, views + count, [](uint32_t v) { return !is_kind(v); }), 2);
    for (size_t i = 0; i < count; ++i)
      if (!is_kind(views[i])) views[i] = 0;
  });
  EXPECT_EQ(sums_of(opened), before);
}

TEST(ShadowVolume, HoldsEveryPointWhoseRaysMeetTheBox) {
  Random random(6);
  size_t inside = 0, outside = 0, met = 0;
  for (int round = 0; round < 400; ++round) {
    trace::Light light;
    if (round % 4 == 3) light.punctual.kind = &lights::kind_named("sun");
    light.punctual.direction = normalize(uniform_point(random, {-1, -1, -1}, {1, 1, 1}));
    if (round % 8 == 7) light.punctual.direction = {0, -1, 0};
    Box blocker;
    for (int k = 0; k < 2; ++k) {
      light.bounds.grow(uniform_point(random, {-3, -3, -3}, {3, 3, 3}));
      blocker.grow(uniform_point(random, {-3, -3, -3}, {3, 3, 3}));
    }
    if (round % 4 == 1) light.bounds.high = light.bounds.low;  // a point
    const trace::ShadowVolume volume(light, blocker, 1e-5f);
    std::vector<float> x, y, z;
    std::vector<uint32_t> marks(300, 0);
    Box bounds;
    bool any = false;
    for (int i = 0; i < 300; ++i) {
      const Vec3f p = uniform_point(random, {-6, -6, -6}, {6, 6, 6});
      x.push_back(p.x), y.push_back(p.y), z.push_back(p.z);
      bool hit = false;
      for (int k = 0; k < 60 && !hit; ++k) {
        const bool sun = light.is_parallel();
        const Vec3f d = sun ? -light.punctual.direction
                            : uniform_point(random, light.bounds.low, light.bounds.high) - p;
        hit = SlabRay(p, d).entry(blocker, sun ? 1e30f : 1.0f) < 1e30f;
      }
      const bool contained = volume.contains(p);
      ASSERT_TRUE(contained || !hit);
      inside += contained, outside += !contained, met += hit;
      if (i < 40) bounds.grow(p), any |= contained;
    }
    EXPECT_FALSE(any && volume.misses(bounds));
    volume.mark(x.data(), y.data(), z.data(), x.size(), marks.data());
    for (size_t i = 0; i < x.size(); ++i)
      ASSERT_EQ(marks[i], uint32_t(volume.contains({x[i], y[i], z[i]})));
  }
  // Exact up to rays that graze an edge, so sixty random rays should find most of what it holds.
  EXPECT_GT(outside, inside / 4);
  EXPECT_GT(double(met), 0.85 * double(inside));
}

TEST(RayFan, AgreesWithSingleRays) {
  Room room(7);
  Random random(7);
  size_t blocked = 0, total = 0;
  for (int round = 0; round < 2000; ++round) {
    trace::RayFan fan;
    fan.origin = uniform_point(random, {-3.9f, 0.1f, -2.9f}, {3.9f, 2.8f, 2.9f});
    fan.to = round % 3 ? 1.0f : std::numeric_limits<float>::infinity();
    fan.count = 1 + random() % trace::RayFan::kMaxRays;
    trace::RayBits wanted{};
    for (size_t i = 0; i < fan.count; ++i) {
      const Vec3f d = uniform_point(random, {-3, -3, -3}, {3, 3, 3});
      fan.x[i] = d.x, fan.y[i] = d.y, fan.z[i] = d.z;
      if (random() % 3) wanted[i / 64] |= uint64_t(1) << (i % 64);
    }
    const trace::RayBits still = room.caster->occluded_static(fan, wanted);
    const trace::RayBits chair = room.caster->occluded_object(1, fan, wanted);
    for (size_t i = 0; i < fan.count; ++i) {
      const Vec3f d{fan.x[i], fan.y[i], fan.z[i]};
      const bool asked = (wanted[i / 64] >> (i % 64)) & 1;
      ASSERT_EQ(bool((still[i / 64] >> (i % 64)) & 1),
                asked && room.caster->occluded_static(fan.origin, d, fan.to));
      ASSERT_EQ(bool((chair[i / 64] >> (i % 64)) & 1),
                asked && room.caster->occluded_object(1, fan.origin, d, fan.to));
      blocked += (still[i / 64] >> (i % 64)) & 1;
      total += asked;
    }
  }
  EXPECT_GT(blocked, total / 10);
  EXPECT_LT(blocked, total);
}

}  // namespace
}  // namespace deltalux::direct
