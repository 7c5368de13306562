// SPDX-License-Identifier: Apache-2.0
// Sums of discs equal those of the stored segments one by one, with the one segment-disc test:
// added, removed in part, removed to nothing; of moving parts in their own space.
#include "session/discs/deposit.h"

#include <gtest/gtest.h>

#include "base/random.h"
#include "disc_world.h"
#include "state_world.h"

namespace deltalux::session {
namespace {

using segments::HitSlots;
using Slots = std::vector<std::vector<uint32_t>>;  // by bounce

std::vector<Variant> variants() {
  std::vector<Variant> out;
  for (const int threads : {1, 3})
    for (const bool collects : {false, true}) {
      for (const auto end : {segments::SegmentEnd::first, segments::SegmentEnd::bounded})
        out.push_back({.threads = threads, .end = end, .collects = collects});
      out.push_back({.threads = threads, .collects = collects, .gathers = true});
    }
  return out;
}

/// All slots of the store, free ones too, shuffled.
Slots all_slots(const State& s, estimate::Draw& draw) {
  Slots out;
  for (const segments::BounceSegments& stored : s.paths.store.bounces()) {
    std::vector<uint32_t>& own = out.emplace_back();
    for (uint32_t slot = 0; slot < stored.size(); ++slot) own.push_back(slot);
    for (size_t i = own.size(); i > 1; --i) std::swap(own[i - 1], own[draw.below(uint32_t(i))]);
  }
  return out;
}

/// A world whose paths are traced, and whose sums are empty again.
struct Emptied : StateWorld {
  explicit Emptied(const Variant& variant) : StateWorld(variant) {
    trace();
    std::fill(s.discs.sums.begin(), s.discs.sums.end(), 0);
  }
  void add(const Slots& slots) {
    Deposit deposit(s.paths, s.discs);
    for (uint32_t bounce = 0; bounce < slots.size(); ++bounce) deposit.add(bounce, slots[bounce]);
    deposit.finish();
  }
  void remove(const Slots& slots) {
    Deposit deposit(s.paths, s.discs);
    for (uint32_t bounce = 0; bounce < slots.size(); ++bounce)
      deposit.remove(bounce, slots[bounce]);
    deposit.finish();
  }
};

size_t count_nonzero(const std::vector<int64_t>& sums) {
  return sums.size() - size_t(std::count(sums.begin(), sums.end(), 0));
}

TEST(Deposit, AddsEverySegmentToEveryDiscThatItCrosses) {
  for (const Variant& variant : variants()) {
    estimate::Draw draw(1);
    Emptied world(variant);
    const Slots slots = all_slots(world.s, draw);
    world.add(slots);
    EXPECT_EQ(world.s.discs.sums, slow_sums(world));
    EXPECT_GT(count_nonzero(world.s.discs.sums), 500u);
  }
}

TEST(Deposit, RemembersUpToTwoDiscs) {
  for (const Variant& variant : variants()) {
    if (variant.collects) continue;
    estimate::Draw draw(2);
    Emptied world(variant);
    world.add(all_slots(world.s, draw));
    size_t many = 0, few = 0;
    world.each([&](uint32_t bounce, uint32_t slot, const segments::Segment& segment) {
      std::vector<uint32_t> crossed;
      if (is_counted(world.s, bounce, segment.path))
        each_crossed(world.s, nullptr, bounce, slot, [&](uint32_t k) { crossed.push_back(k); });
      HitSlots found = world.s.paths.store.bounce(bounce).slots(slot);
      if (crossed.size() > 2) {
        EXPECT_EQ(found.disc[0], HitSlots::kMany);
        ++many;
        return;
      }
      crossed.resize(2, HitSlots::kFree);
      std::sort(found.disc, found.disc + 2);
      EXPECT_EQ(found.disc[0], crossed[0]);
      EXPECT_EQ(found.disc[1], crossed[1]);
      few += crossed[0] != HitSlots::kFree;
    });
    EXPECT_GT(many, 100u);
    EXPECT_GT(few, 100u);
  }
}

TEST(Deposit, RemovesExactlyWhatItAdded) {
  for (const Variant& variant : variants()) {
    estimate::Draw draw(3);
    Emptied world(variant);
    Slots rest = all_slots(world.s, draw);
    world.add(rest);
    std::vector<std::vector<uint8_t>> there;
    Slots gone;
    for (std::vector<uint32_t>& slots : rest) {
      gone.push_back({slots.begin(), slots.begin() + long(slots.size() / 3)});
      slots.erase(slots.begin(), slots.begin() + long(slots.size() / 3));
      std::vector<uint8_t>& own = there.emplace_back(gone.back().size() + slots.size());
      for (const uint32_t slot : slots) own[slot] = 1;
    }
    world.remove(gone);
    EXPECT_EQ(world.s.discs.sums, slow_sums(world, [&](uint32_t bounce, uint32_t slot) {
                return there[bounce][slot] != 0;
              }));
    world.remove(rest);
    EXPECT_EQ(count_nonzero(world.s.discs.sums), 0u);
  }
}

TEST(Deposit, LeavesOutPartsThatAreNotCurrentOrNotPresent) {
  for (const Variant& variant : variants()) {
    estimate::Draw draw(4);
    Emptied world(variant);
    const Slots slots = all_slots(world.s, draw);
    world.s.discs.moving[0].current = false;
    world.s.scene.objects[2].present = false;
    world.add(slots);
    EXPECT_EQ(world.s.discs.sums, slow_sums(world));
    // Its samples come later, from the same segments.
    world.s.discs.moving[0].current = true;
    Deposit deposit(world.s.paths, world.s.discs);
    for (uint32_t bounce = 0; bounce < slots.size(); ++bounce)
      deposit.add_to_part(world.s.discs.moving[0], bounce, slots[bounce]);
    deposit.finish();
    const std::vector<int64_t> sums = world.s.discs.sums;
    EXPECT_EQ(sums, slow_sums(world));
    // Only its own sums are cleared.
    world.s.discs.clear_part(world.s.discs.moving[0]);
    EXPECT_LT(count_nonzero(world.s.discs.sums), count_nonzero(sums));
    world.s.discs.moving[0].current = false;
    EXPECT_EQ(world.s.discs.sums, slow_sums(world));
  }
}

TEST(Deposit, AddsMomentsOfAllSegmentsToOtherSums) {
  for (const Variant& variant : variants()) {
    Emptied world(variant);
    const std::vector<int64_t> before = world.s.discs.sums;
    std::vector<int64_t> sums(before.size()), moments(2 * before.size()), none(before.size());
    Deposit deposit(world.s.paths, world.s.discs,
                    {sums.data(), world.s.samples.size(), true, moments.data()});
    deposit.add_all(world.progress);
    Deposit plain(world.s.paths, world.s.discs, {none.data(), world.s.samples.size()});
    plain.add_all(world.progress);
    EXPECT_EQ(world.s.discs.sums, before);
    EXPECT_EQ(none, slow_sums(world));
    // Gradients come from discs even where light comes from a gather.
    world.s.options.gather_rays = 0;
    EXPECT_EQ(sums, slow_sums(world));
    std::vector<int64_t> expected(moments.size());
    world.each([&](uint32_t bounce, uint32_t slot, const segments::Segment& segment) {
      if (!is_counted(world.s, bounce, segment.path)) return;
      const samples::DiscSet& discs = world.s.discs.still->discs();
      const Vec3f o = segment.origin, w = decode_direction(segment.direction);
      each_crossed(world.s, nullptr, bounce, slot, [&](uint32_t disc) {
        const auto crossing = estimate::crosses(
            discs, disc, o, w, segment.length,
            world.s.paths.store.bounces()[bounce].extended_or_length(slot), variant.end);
        estimate::add_moments({sums.data(), world.s.samples.size(), false, expected.data()}, discs,
                              disc, crossing.offset, slow_slab_of(world.s, segment.path),
                              segment.power, 1);
      });
    });
    const size_t each = 6 * world.s.samples.size();
    for (size_t i = 0; i < expected.size(); ++i)
      if (world.s.samples.attached[i % each / 6] == scene::kNone) {
        ASSERT_EQ(moments[i], expected[i]) << i;
      }
    EXPECT_GT(count_nonzero(expected), 500u);
  }
}

TEST(Deposit, PartsMoveWithTheirObjects) {
  Emptied world({});
  MovingPart& part = world.s.discs.moving[1];
  const Box before = part.world;
  world.change(2, [](scene::Object& own) { own.pose.translation = {2, 1.5, 1}; });
  const Vec3f off = Vec3f{2, 1.5f, 1} - Vec3f{3, 0.4f, 2.6f};
  EXPECT_LT(length(part.world.low - before.low - off), 1e-6f);
  EXPECT_LT(length(part.world.high - before.high - off), 1e-6f);
  EXPECT_TRUE(part.world.contains(
      world.s.scene.objects[2].pose.box(part.local).padded(world.s.caster->margin())));
}

}  // namespace
}  // namespace deltalux::session
