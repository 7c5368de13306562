// SPDX-License-Identifier: Apache-2.0
// Each layer of a session alone, with nothing but a world: prepared, saved, restored, and taken
// over by another world of the same scene.
#include <gtest/gtest.h>

#include <cmath>

#include "memory_archive.h"
#include "session/direct/direct_layer.h"
#include "session/discs/deposit.h"
#include "session/images/image_layer.h"
#include "session/paths/pending.h"
#include "session/paths/pilot_paths.h"
#include "session_world.h"

namespace deltalux::session {
namespace {

/// The world of a bake, up to the point where layers begin.
struct BakedWorld : World {
  explicit BakedWorld(const Options& options) : World(room_with_spot(), some_samples(), options) {
    index_triangles(progress);
    allot_paths(progress);
    resolve_radii(progress);
  }
  Progress progress;
};

Options by_paths() { return options(1, DirectMode::paths, segments::SegmentEnd::first); }

template <class Layer>
std::array<uint64_t, 2> digest_of(const Layer& layer) {
  Lanes lanes;
  layer.digest(lanes);
  return {lanes.a, lanes.b};
}

/// Discs with estimators and areas, as a bake makes them.
void make(BakedWorld& world, DiscLayer& discs) {
  PlacedDiscs placed = discs.place(world.progress);
  discs.take(placed);
  discs.plan(placed, walk_pilot_paths(world, world.progress), false, world.progress);
  discs.make_estimators(placed, world.progress);
  discs.clear_sums();
  discs.refresh_areas(nullptr);
}

TEST(PathLayer, HoldsItsRangeAndWaits) {
  Options chosen = by_paths();
  chosen.range = PathRange{1000, 2500};
  BakedWorld world(chosen);
  PathLayer paths(world);
  paths.prepare();
  EXPECT_EQ(paths.pending_share(), 0);
  EXPECT_GT(paths.held.size(), 1400u);
  EXPECT_LT(paths.held.size(), 1600u);
  EXPECT_EQ(paths.hash().count, 0u);
  paths.wait();
  EXPECT_EQ(paths.pending_share(), 1);
  EXPECT_EQ(paths.pending.size(), paths.held.size());
  EXPECT_TRUE(agree(paths));
  EXPECT_GT(paths.bytes(), paths.held.size() * sizeof(segments::Segment));
  EXPECT_EQ(paths.level_sizes(), std::vector<uint64_t>{paths.held.size()});
}

TEST(PathLayer, IsRestoredAsItWasSaved) {
  BakedWorld world(by_paths());
  PathLayer paths(world), other(world);
  paths.wait();
  ArchiveView view;
  paths.save(view);
  view.keep("level_sizes", paths.level_sizes());
  other.held = world.held();
  MemoryArchive archive(view);
  other.restore(archive, 0, 0, world.progress);
  EXPECT_EQ(other.cut, paths.cut);
  EXPECT_EQ(other.level_sizes(), paths.level_sizes());
  ASSERT_EQ(other.pending.size(), paths.pending.size());
  for (size_t i = 0; i < paths.pending.size(); ++i)
    EXPECT_EQ(other.pending[i].path, paths.pending[i].path);
  EXPECT_TRUE(agree(other));
  // A path that waits at another bounce than its mark says.
  MemoryArchive damaged(view);
  damaged.arrays.at("pending")[8] = std::byte{1};
  PathLayer third(world);
  third.held = world.held();
  EXPECT_THROW(third.restore(damaged, 0, 0, world.progress), FormatError);
}

TEST(DiscLayer, AnotherWorldTakesItsChoices) {
  BakedWorld world(by_paths());
  DiscLayer discs(world);
  make(world, discs);
  ASSERT_EQ(discs.moving.size(), 1u);
  EXPECT_EQ(discs.sums.size(), world.slabs() * world.samples.size() * 3);
  EXPECT_EQ(discs.plans.size(), 2u);
  for (const float area : discs.area) EXPECT_TRUE(area > 0 && std::isfinite(area));
  BakedWorld next(by_paths());
  DiscLayer taken(next);
  taken.take_choices(discs);
  EXPECT_EQ(taken.still, discs.still);
  EXPECT_TRUE(taken.sums.empty());
  taken.clear_sums();
  taken.refresh_areas(nullptr);
  EXPECT_EQ(taken.area, discs.area);
  EXPECT_EQ(digest_of(taken), digest_of(discs));
  taken.energy().add(0, 3, std::array<uint32_t, 3>{1, 2, 3}.data(), +1);
  EXPECT_NE(digest_of(taken), digest_of(discs));
}

TEST(DiscLayer, IsRestoredAsItWasSaved) {
  BakedWorld world(by_paths());
  DiscLayer discs(world), other(world);
  make(world, discs);
  ArchiveView view;
  discs.save_choices(view);
  MemoryArchive archive(view);
  PlacedDiscs placed = other.restore_choices(archive, world.progress);
  other.plan(placed, walk_pilot_paths(world, world.progress), false, world.progress);
  other.make_estimators(placed, world.progress);
  other.clear_sums();
  EXPECT_EQ(other.openness, discs.openness);
  EXPECT_EQ(digest_of(other), digest_of(discs));
}

TEST(DiscLayer, AreasFollowWhatMoves) {
  BakedWorld world(by_paths());
  DiscLayer discs(world), fresh(world);
  make(world, discs);
  const std::vector<float> before = discs.area;
  std::vector<ObjectChange> changes{{1, world.caster->object_bounds(1), {}}};
  world.scene.objects[1].pose.translation = {1.75, 0.3, 1.75};  // stands on four samples
  world.caster->update_object(world.scene, 1);
  changes[0].after = world.caster->object_bounds(1);
  discs.place_parts();
  discs.refresh_areas(&changes);
  EXPECT_NE(discs.area, before);
  make(world, fresh);
  EXPECT_EQ(discs.area, fresh.area);
}

TEST(DiscLayer, SpareDiscsAreInPlaceForAWhile) {
  BakedWorld world(gathering(1));
  ASSERT_FALSE(world.counts_in_discs());
  DiscLayer discs(world);
  PlacedDiscs none;
  discs.plan(none, {}, false, world.progress);
  discs.make_estimators(none, world.progress);
  EXPECT_EQ(discs.still->discs().size(), 0u);
  for (int again = 0; again < 2; ++again) {
    const DiscsInPlace in_place(world, discs, world.progress);
    EXPECT_EQ(discs.still->discs().size(), 64u);
  }
  EXPECT_EQ(discs.still->discs().size(), 0u);
  EXPECT_GT(discs.spare->bytes(), 0u);
}

TEST(DirectLayer, IsRestoredAsItWasSaved) {
  BakedWorld world(options(1, DirectMode::sampled, segments::SegmentEnd::first));
  DirectLayer direct(world), other(world);
  direct.compute(world.progress);
  EXPECT_EQ(direct.receivers.size(), world.samples.size());
  EXPECT_EQ(direct.pending_share(), 0);
  ArchiveView view;
  direct.save_choices(view);
  direct.save(view);
  MemoryArchive archive(view);
  other.restore(archive);
  EXPECT_EQ(digest_of(other), digest_of(direct));
  EXPECT_EQ(other.receivers, direct.receivers);
  EXPECT_GT(direct.scales->reference, 0);
  EXPECT_EQ(other.scales->reference, direct.scales->reference);
  MemoryArchive damaged(view);
  damaged.arrays.at("direct.scales")[15] = std::byte{0xff};  // a negative reference
  DirectLayer third(world);
  EXPECT_THROW(third.restore(damaged), FormatError);
  EXPECT_EQ(third.light, nullptr);
}

TEST(DirectLayer, FollowsWhatMovesAsIfItWereComputedAnew) {
  BakedWorld world(options(1, DirectMode::sampled, segments::SegmentEnd::first));
  DirectLayer direct(world), fresh(world);
  direct.compute(world.progress);
  const auto before = digest_of(direct);
  std::vector<ObjectChange> changes{{1, world.caster->object_bounds(1), {}}};
  world.scene.objects[1].pose = at(2, 2);  // below the lamp
  world.caster->update_object(world.scene, 1);
  changes[0].after = world.caster->object_bounds(1);
  trace::Change edit;
  edit.objects.push_back({1, boxes_of(changes), changes[0].after});
  edit.lights.assign(world.lights.size(), 0);
  direct.update(edit, changes, world.lights.size(), 0, world.progress);
  EXPECT_NE(digest_of(direct), before);
  fresh.scales = direct.scales;
  fresh.compute(world.progress);
  EXPECT_EQ(digest_of(direct), digest_of(fresh));
}

/// The layers of a final gather, whose cells all hold some light.
struct Gathered {
  explicit Gathered(BakedWorld& w) : world(w), direct(w), cells(w), rays(w, direct, cells) {
    cells.divide(world.progress);
    for (uint32_t cell = 0; cell < cells.division.size(); ++cell)
      for (uint32_t batch = 0; batch < kBatches; ++batch)
        for (size_t c = 0; c < 3; ++c)
          cells.sums.quanta[cells.sums.at(cell, 0, batch) + c] =
              int64_t(1 + (7 * cell + 3 * batch + c) % 11) << 20;
    cells.cover(world.progress);
    direct.compute(world.progress);
    rays.place();
    rays.guiding.doublings.assign(world.samples.size(), 0);
    rays.hits = rays.uncast(rays.targets_of_samples(world.progress));
  }
  std::vector<double> light() {
    const gather::Evaluation now = rays.evaluation(false);
    std::vector<double> out;
    for (size_t i = 0; i < world.samples.size(); ++i) {
      const gather::SampleLight own = now.read(rays.hits, i);
      out.insert(out.end(), own.irradiance, own.irradiance + 3);
    }
    return out;
  }

  BakedWorld& world;
  DirectLayer direct;
  CellLayer cells;
  RayLayer rays;
};

/// Moves the box below the lamp; returns what that changed.
trace::Change move_box(World& world) {
  std::vector<ObjectChange> changes{{1, world.caster->object_bounds(1), {}}};
  world.scene.objects[1].pose = at(2, 2);
  world.scene.objects[1].pose.translation.y = 0.3;  // on the floor
  world.caster->update_object(world.scene, 1);
  changes[0].after = world.caster->object_bounds(1);
  trace::Change edit;
  edit.objects.push_back({1, boxes_of(changes), changes[0].after});
  edit.lights.assign(world.lights.size(), 0);
  return edit;
}

TEST(CellLayer, HasNothingWithoutAGather) {
  BakedWorld world(by_paths());
  CellLayer cells(world);
  cells.divide(world.progress);
  cells.grow(world.progress);
  EXPECT_EQ(cells.division.size(), 0u);
  EXPECT_TRUE(cells.sums.quanta.empty());
  EXPECT_EQ(digest_of(cells), digest_of(CellLayer(world)));
}

TEST(CellLayer, GrowsAndShrinksWithTheScene) {
  BakedWorld world(gathering(1));
  CellLayer cells(world);
  cells.divide(world.progress);
  const uint32_t before = cells.division.size();
  ASSERT_GT(before, 50u);
  EXPECT_EQ(cells.sums.quanta.size(), cells.sums.at(before, 0, 0));
  cells.sums.quanta[cells.sums.at(3, 0, 2)] = 5;
  EXPECT_TRUE(cells.is_lit(3));
  EXPECT_FALSE(cells.is_lit(4));
  EXPECT_TRUE(cells.are_sums_possible());
  const auto digest = digest_of(cells);
  world.scene.objects.push_back(second_lamp());
  world.scene.finish();
  world.caster->update_object(world.scene, 2);
  cells.grow(world.progress);
  EXPECT_GT(cells.division.size(), before);
  EXPECT_EQ(cells.sums.touched.size(), cells.division.size());
  world.scene.objects.pop_back();
  cells.shrink();
  EXPECT_EQ(cells.division.size(), before);
  EXPECT_EQ(digest_of(cells), digest);
  cells.sums.quanta[cells.sums.at(4, 0, 0)] = -1;
  EXPECT_FALSE(cells.are_sums_possible());
  EXPECT_NE(digest_of(cells), digest);
}

TEST(CellLayer, CoversFollowWhatMoves) {
  BakedWorld world(gathering(1));
  Gathered own(world);
  const auto before = digest_of(own.cells);
  own.cells.update(move_box(world));
  EXPECT_NE(digest_of(own.cells), before);  // the box has come to stand on the floor
  EXPECT_EQ(digest_of(own.cells), digest_of(Gathered(world).cells));
}

TEST(RayLayer, FollowsWhatMovesAsIfAllWereCastAnew) {
  BakedWorld world(gathering(1));
  Gathered own(world);
  own.rays.cast(world.progress);
  EXPECT_TRUE(own.rays.all_cast());
  const std::vector<double> before = own.light();
  gather::Change change{move_box(world), std::vector<uint8_t>(world.samples.size()), {}};
  own.direct.place();
  for (size_t i = 0; i < world.samples.size(); ++i)
    change.samples[i] = world.samples.attached[i] == 1;
  own.cells.update(change.scene);
  own.rays.note(change);
  EXPECT_GT(own.rays.pending_share(), 0);
  // No time at first, then as much as it takes.
  own.rays.follow(world.progress, [] { return false; });
  EXPECT_GT(own.rays.pending_share(), 0);
  const gather::GatherHits::Cast cast = own.rays.follow(world.progress, [] { return true; });
  EXPECT_EQ(own.rays.pending_share(), 0);
  EXPECT_LT(cast.rays, own.rays.hits.rays().all());
  Gathered fresh(world);
  fresh.rays.cast(world.progress);
  EXPECT_EQ(digest_of(own.rays), digest_of(fresh.rays));
  EXPECT_EQ(own.light(), fresh.light());
  EXPECT_NE(own.light(), before);
}

TEST(RayLayer, IsRestoredAsItWasSaved) {
  BakedWorld world(gathering(1));
  Gathered own(world), other(world);
  own.rays.guiding.doublings.assign(world.samples.size(), 1);
  own.rays.hits = own.rays.uncast(own.rays.targets_of_samples(world.progress));
  own.rays.cast(world.progress);
  ArchiveView view;
  own.rays.save(view);
  MemoryArchive archive(view);
  other.rays.restore_choices(archive);
  EXPECT_EQ(other.rays.guiding.doublings, own.rays.guiding.doublings);
  other.rays.restore(archive, world.progress);
  EXPECT_EQ(digest_of(other.rays), digest_of(own.rays));
  EXPECT_EQ(other.light(), own.light());
  // More rays than the memory limit has room for.
  world.options.memory_limit = 1000;
  MemoryArchive again(view);
  EXPECT_THROW(Gathered(world).rays.restore_choices(again), FormatError);
}

TEST(ImageLayer, WhatIsKeptChangesNoBit) {
  BakedWorld world(gathering(1));
  Gathered own(world);
  ImageLayer keeps(own.rays), forgets(own.rays);
  std::vector<Vec3f> points, normals;
  for (int i = 0; i < 24; ++i) {
    points.push_back({0.3f + 0.4f * float(i % 6), 0, 0.4f + 0.8f * float(i / 6)});
    normals.push_back({0, 1, 0});
  }
  struct Light {
    std::vector<double> direct, indirect;
    bool operator==(const Light&) const = default;
  };
  const auto ask = [&](ImageLayer& layer, size_t keep_bytes) {
    Light out{std::vector<double>(3 * points.size()), std::vector<double>(3 * points.size())};
    layer.gather_at(points, normals, {64, false, keep_bytes}, out.direct.data(),
                    out.indirect.data(), nullptr, world.progress);
    return out;
  };
  const Light before = ask(keeps, 1 << 24);
  EXPECT_EQ(before, ask(forgets, 0));
  EXPECT_EQ(keeps.kept->taken(), 0u);
  EXPECT_EQ(before, ask(keeps, 1 << 24));
  EXPECT_EQ(keeps.kept->taken(), points.size());
  EXPECT_GT(keeps.bytes(), 0u);
  EXPECT_EQ(forgets.bytes(), 0u);
  gather::Change change{move_box(world), std::vector<uint8_t>(world.samples.size()), {}};
  own.direct.place();
  own.cells.update(change.scene);
  own.rays.note(change);
  keeps.note(change);
  const Light after = ask(keeps, 1 << 24);
  EXPECT_EQ(after, ask(forgets, 0));
  EXPECT_NE(after, before);
  EXPECT_GT(keeps.kept->taken(), points.size());
}

}  // namespace
}  // namespace deltalux::session
