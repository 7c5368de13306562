// SPDX-License-Identifier: Apache-2.0
// Beams: points lie where the light lands, chances add up to one, updates equal a new start.
#include "gather/aim/beams.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "direct_world.h"
#include "gather/aim/guide.h"
#include "gather/choose/find_guides.h"
#include "lights/kinds.h"
#include "trace/scatter.h"

namespace deltalux::gather {
namespace {

constexpr float kOuter = 0.03f;  // versine: a half angle of 14 degrees

/// A room of 4 m; a spot at its ceiling shines aslant past a table that stands in half of its way;
/// object 1 moves.
struct SpotRoom : direct::World {
  SpotRoom() {
    scene.objects.resize(2);
    direct::add_box(scene.objects[0], {4, 3, 4}, {0, 0, 0});  // inward
    direct::add_quad(scene.objects[0], {1, 1, 1}, {0, 0, 1.1f}, {1.1f, 0, 0});
    direct::add_box(scene.objects[1], {-0.2f, -0.2f, -0.2f}, {0.2f, 0.2f, 0.2f});
    scene.objects[1].movable = true;
    scene.objects[1].pose.translation = {3.5f, 0.3f, 3.5f};
    scene::PunctualLight spot{};
    spot.kind = &lights::kind_named("spot");
    spot.position = {1.8f, 2.9f, 1.7f};
    spot.direction = {0.1f, -1, 0.12f};
    spot.intensity = {100, 80, 60};
    spot.parameters = {0.01f, kOuter};
    scene.lights = {spot};
    finish();
  }
  void move(Vec3d to) {
    scene.objects[1].pose.translation = to;
    caster->update_object(scene, 1);
  }
  Beam beam() const {
    Beam own(lights[0], {0, 50, 1}, 0, scene.beyond(), 7);
    own.compute(*caster);
    return own;
  }
};

direct::Receiver landing(const SpotRoom& room, Vec3f origin, Vec3f w, const trace::Hit& hit) {
  return {origin + w * hit.t, trace::facing_normal(hit, w), scene::kNone,
          room.scene.slack_of(hit.primitive)};
}

TEST(Beam, PointsLieWhereItsLightLands) {
  const SpotRoom room;
  const Beam beam = room.beam();
  uint32_t on_table = 0;
  for (uint32_t k = 0; k < Beam::kPoints; ++k) {
    ASSERT_TRUE(beam.point(k).valid());
    const Vec3f w = normalize(beam.point(k).at - room.lights[0].punctual.position);
    EXPECT_LT(1 - dot(w, room.lights[0].punctual.direction), kOuter + 1e-5f);
    on_table += beam.point(k).at.y > 0.5f;
  }
  EXPECT_GT(on_table, Beam::kPoints / 4);
  EXPECT_LT(on_table, 3 * Beam::kPoints / 4);
}

TEST(Beam, ChancesOfDirectionsAddUpToWhatIsSeen) {
  // Uniform directions against the share of its points that are seen, by definition.
  const SpotRoom room;
  const Beam beam = room.beam();
  for (const Vec3f from : {Vec3f{2, 2.8f, 2.1f}, Vec3f{0.3f, 0.4f, 0.5f}, Vec3f{3.8f, 2, 0.2f}}) {
    uint32_t seen = 0;
    for (uint32_t k = 0; k < Beam::kPoints; ++k) {
      const Vec3f w = beam.point(k).seen_from(from);
      if (w == Vec3f{}) continue;
      seen += beam.point(k).is_met(from, w, room.caster->closest(from, w));
    }
    constexpr uint32_t kCount = 1 << 20;
    double sum = 0;
    for (uint32_t i = 0; i < kCount; ++i) {
      const auto r = sobol::sample(i, 3);
      const float z = 2 * r[0] - 1, flat = std::sqrt(1 - z * z);
      const float phi = 2 * std::numbers::pi_v<float> * r[1];
      const Vec3f w{flat * std::cos(phi), z, flat * std::sin(phi)};
      const trace::Hit hit = room.caster->closest(from, w);
      bool in_beam = false;
      if (hit.valid())
        sum += double(
            beam.density({from, w, hit.t, landing(room, from, w, hit), *room.caster}, in_beam));
    }
    EXPECT_GT(seen, 500u);
    EXPECT_NEAR(4 * sum / kCount, double(seen) / Beam::kPoints, 0.012) << from.x;
  }
}

TEST(Beam, WhatMovesChangesThePointsItTouches) {
  SpotRoom room;
  Beam beam = room.beam();
  std::vector<uint8_t> changed(Beam::kPoints);
  Box before = room.caster->object_bounds(1);
  // Into the beam, along it, out of it, and far from it.
  const Vec3d places[] = {{1.9, 1.8, 1.8}, {2.0, 0.6, 1.9}, {3.5, 0.3, 0.5}, {0.4, 0.3, 3.5}};
  for (const Vec3d& place : places) {
    room.move(place);
    const Box after = room.caster->object_bounds(1);
    std::fill(changed.begin(), changed.end(), 0);
    const trace::Change change{{{1, {before, after}, after}}, {}};
    const Beam old = beam;
    const bool any = beam.update(*room.caster, change, changed);
    const Beam fresh = room.beam();
    size_t differ = 0;
    for (uint32_t k = 0; k < Beam::kPoints; ++k) {
      ASSERT_EQ(beam.point(k), fresh.point(k));
      ASSERT_EQ(bool(changed[k]), !(beam.point(k) == old.point(k)));
      differ += changed[k];
    }
    EXPECT_EQ(any, differ > 0);
    EXPECT_EQ(differ > 0, place.x != 0.4);
    before = after;
  }
}

TEST(Beam, SharesDoNotDependOnWhatMoves) {
  SpotRoom room;
  const Vec3f from{2.5f, 0.01f, 2.5f}, n{0, 1, 0};
  const Beam far = room.beam();
  room.move({1.9, 1.8, 1.8});
  const Beam near = room.beam();
  EXPECT_EQ(far.share(from, n), near.share(from, n));
  EXPECT_EQ(far.brought(from, n), near.brought(from, n));
  // Beside a pool in its own plane, where something could stand.
  EXPECT_GT(far.share({1.9f, 1.001f, 2.05f}, {0, 1, 0}), 0);
}

TEST(Beam, OfALampThatIsOffLandsNowhere) {
  SpotRoom room;
  trace::Light light = room.lights[0];
  light.on = false;
  Beam dark(light, {0, 50, 1}, 0, room.scene.beyond(), 7);
  dark.compute(*room.caster);
  EXPECT_FALSE(dark.point(0).valid());
  EXPECT_EQ(dark.share({1, 0.1f, 1}, {0, 1, 0}), 0);
}

TEST(FindBesidePools, KeepsGuidesWithLittleOfABeam) {
  SpotRoom room;
  const std::vector<BeamGuide> guides = {{0, 50, 1}};
  const Beams beams(guides, room.scene, room.lights, *room.caster, {}, 7);
  const Beam::Point& point = beams[0].point(Beam::number(0.3f, 0.6f));
  ASSERT_TRUE(point.valid());
  const auto at = [&](float half, Vec3f normal) {
    Guide guide{};
    guide.centre = point.at, guide.normal = normal, guide.half = half, guide.rise = 0.01f;
    return guide;
  };
  const Guide little = at(0.02f, point.normal), pool = at(2, point.normal);
  const Guide aslant = at(0.02f, {1, 0, 0});
  const Guide beside = [&] {
    Guide guide = little;
    guide.centre.x += 2;
    return guide;
  }();
  Guide above = little;  // farther than its rise
  above.centre = above.centre + point.normal * 0.05f;
  const std::vector<Guide> all = {pool, little, aslant, beside, above};
  const std::vector<Guide> kept = find_beside_pools(all, beams, {});
  ASSERT_EQ(kept.size(), 1u);
  EXPECT_EQ(kept[0].half, little.half);
  EXPECT_EQ(kept[0].normal, point.normal);
  EXPECT_EQ(kept[0].centre, point.at);
  const std::vector<Guide> known = {pool};
  EXPECT_TRUE(find_beside_pools(all, beams, known).empty());
  EXPECT_EQ(find_beside_pools(all, beams, std::vector{aslant}).size(), 1u);
}

}  // namespace
}  // namespace deltalux::gather
