// SPDX-License-Identifier: Apache-2.0
// Each layer of a session alone, with nothing but a world: prepared, saved, restored, and taken
// over by another world of the same scene.
#include <gtest/gtest.h>

#include <cmath>

#include "memory_archive.h"
#include "session/direct/direct_layer.h"
#include "session/discs/deposit.h"
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
    choose_direct(0);
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

}  // namespace
}  // namespace deltalux::session
