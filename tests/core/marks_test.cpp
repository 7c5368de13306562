// SPDX-License-Identifier: Apache-2.0
// Marks of edits against a list of paths that is kept the slow way: each path once, from its first
// affected bounce on, older edits first.
#include <gtest/gtest.h>

#include "disc_world.h"
#include "state_world.h"

namespace deltalux::session {
namespace {

/// A path's segment as an edit would name it.
PendingPath segment_of(const State& s, uint32_t path, uint32_t bounce) {
  uint32_t slot = s.paths.held.slot_of(path);
  for (uint32_t b = 0; b < bounce; ++b) slot = s.paths.store.bounces()[b].at(slot).next;
  return {path, slot, uint16_t(bounce), false, {}};
}

uint32_t length_of(const State& s, uint32_t path) {
  uint32_t bounces = 1;
  for (uint32_t slot = s.paths.held.slot_of(path);
       (slot = s.paths.store.bounces()[bounces - 1].at(slot).next) != segments::kNoSlot;)
    ++bounces;
  return bounces;
}

/// The marks of one edit, in the order of an update: by bounce.
std::vector<PendingPath> some_marks(const State& s, estimate::Draw& draw, float share) {
  std::vector<PendingPath> out;
  for (uint32_t slot = 0; slot < s.paths.held.size(); ++slot)
    for (uint32_t bounce = 0; bounce < length_of(s, s.paths.held.path_of(slot)); ++bounce) {
      if (!draw.chance(share)) continue;
      out.push_back(segment_of(s, s.paths.held.path_of(slot), bounce));
      out.back().hit_known = draw.chance(0.5f);
      out.back().hit.t = draw.unit();
    }
  std::stable_sort(out.begin(), out.end(),
                   [](const auto& a, const auto& b) { return a.bounce < b.bounce; });
  return out;
}

/// The share of its light's paths that come before it, in 64 steps.
uint64_t step_of(const State& s, uint32_t path) {
  const trace::Light& light = s.lights[slow_light_of(s, path)];
  return 64 * (path - light.first_path) / light.path_count;
}

void expect_equal(const std::vector<PendingPath>& found, const std::vector<PendingPath>& expected) {
  ASSERT_EQ(found.size(), expected.size());
  for (size_t i = 0; i < found.size(); ++i) {
    ASSERT_EQ(found[i].path, expected[i].path) << i;
    EXPECT_EQ(found[i].bounce, expected[i].bounce) << i;
    EXPECT_EQ(found[i].slot, expected[i].slot) << i;
    EXPECT_EQ(found[i].hit_known, expected[i].hit_known) << i;
    if (found[i].hit_known) {
      EXPECT_EQ(found[i].hit.t, expected[i].hit.t) << i;
    }
  }
}

/// Marks the way of the list that marks.mark() keeps; returns how many paths it cuts earlier.
size_t mark_slowly(std::vector<PendingPath>& list, std::span<const PendingPath> marks) {
  size_t earlier = 0;
  for (const PendingPath& path : marks) {
    const auto own = std::find_if(list.begin(), list.end(),
                                  [&](const PendingPath& p) { return p.path == path.path; });
    if (own == list.end()) {
      list.push_back(path);
    } else if (path.bounce < own->bounce) {
      *own = path;
      ++earlier;
    }
  }
  return earlier;
}

void follow_edits(const Variant& variant, bool ordered) {
  StateWorld world(variant);
  world.trace();
  State& s = world.s;
  estimate::Draw draw(ordered);
  const std::vector<PendingPath>& waiting = s.paths.pending;
  std::vector<PendingPath> expected;
  size_t earlier = 0;
  for (const float share : {0.1f, 0.2f, 0.05f}) {
    const std::vector<PendingPath> own = some_marks(s, draw, share);
    EditMarks marks(s.paths);
    for (const PendingPath& path : own) marks.mark(path);
    const auto older = long(expected.size());
    for (PendingPath& path : expected) path.hit_known = false;
    earlier += mark_slowly(expected, own);
    if (ordered) {
      marks.order();
      std::stable_sort(expected.begin() + older, expected.end(),
                       [&](const PendingPath& a, const PendingPath& b) {
                         return step_of(s, a.path) < step_of(s, b.path);
                       });
    }
    expect_equal(waiting, expected);
    std::vector<uint16_t> cut(s.paths.held.size(), kNotCut);
    for (const PendingPath& path : expected) cut[s.paths.held.slot_of(path.path)] = path.bounce;
    EXPECT_EQ(s.paths.cut, cut);
    EXPECT_TRUE(agree(s.paths));
  }
  EXPECT_GT(earlier, 20u);
  EXPECT_GT(waiting.size(), 100u);
  EXPECT_LT(waiting.size(), s.paths.held.size());
}

TEST(Marks, KeepEachPathOnceFromItsFirstAffectedBounce) {
  for (const bool ordered : {false, true}) follow_edits({.paths = 1000}, ordered);
}

// Where slots are not the numbers of paths.
TEST(Marks, AreThoseOfTheHeldPaths) {
  for (const bool ordered : {false, true})
    follow_edits({.paths = 2000, .range = PathRange{900, 1700}}, ordered);
}

}  // namespace
}  // namespace deltalux::session
