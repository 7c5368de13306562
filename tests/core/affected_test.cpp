// SPDX-License-Identifier: Apache-2.0
// The search finds exactly the segments whose flight an edit changes: every stored segment is flown
// again, in the new scene, and compared. Then the paths are replaced, as a Session does it.
#include "session/flow/affected.h"

#include <gtest/gtest.h>

#include "state_world.h"

namespace deltalux::session {
namespace {

/// Whether origin + t w, 0 <= t <= reach, meets the box grown by `more`.
bool meets(const Box& box, Vec3f o, Vec3f w, float reach, double more) {
  if (box.empty()) return false;
  double enter = 0, leave = reach;
  for (int axis = 0; axis < 3; ++axis) {
    const double low = double(box.low[axis]) - more, high = double(box.high[axis]) + more;
    if (w[axis] == 0) {
      if (o[axis] < low || o[axis] > high) return false;
      continue;
    }
    const double p = (low - o[axis]) / w[axis], q = (high - o[axis]) / w[axis];
    enter = std::max(enter, std::min(p, q)), leave = std::min(leave, std::max(p, q));
  }
  return enter <= leave;
}

/// What an edit changed of the scene.
struct Edited {
  std::vector<ObjectChange> changes;
  std::vector<uint8_t> materials;

  bool changed(uint32_t object) const {
    return std::any_of(changes.begin(), changes.end(),
                       [&](const ObjectChange& c) { return c.object == object; });
  }
  /// Whether the edit changes the object or the material that the primitive belongs to.
  bool touches(const scene::Scene& scene, uint32_t primitive) const {
    if (primitive == scene::kNone) return false;
    return changed(scene.object_of(primitive)) ||
           (!materials.empty() && materials[scene.material_index(primitive)]);
  }
};

/// Edits one after the other; each leaves its traces in the slots of the next.
std::vector<std::function<Edited(StateWorld&)>> edits() {
  const auto move = [](uint32_t object, Pose pose) {
    return [=](StateWorld& world) {
      return world.change(object, [&](scene::Object& own) { own.pose = pose; });
    };
  };
  const auto show = [](uint32_t object, bool present) {
    return [=](StateWorld& world) {
      return world.change(object, [&](scene::Object& own) { own.present = present; });
    };
  };
  const auto paint = [](StateWorld& world, uint32_t material) {
    world.s.scene.materials[material].reflectance = {0.4f, 0.3f, 0.6f};
    std::vector<uint8_t> out(world.s.scene.materials.size());
    out[material] = 1;
    return out;
  };
  return {
      [=](StateWorld& w) { return Edited{{move(1, turned(at(1.3, 0.5, 1.2), 2, -0.3))(w)}, {}}; },
      [=](StateWorld& w) { return Edited{{show(2, false)(w)}, {}}; },
      [=](StateWorld& w) {
        return Edited{{move(1, turned(at(2, 1.4, 2), 0, 1))(w), move(2, at(2.1, 0.5, 2.1))(w)}, {}};
      },
      [=](StateWorld& w) { return Edited{{show(2, true)(w)}, {}}; },
      [=](StateWorld& w) { return Edited{{}, paint(w, 2)}; },
      [=](StateWorld& w) { return Edited{{move(1, at(1, 0.6, 3))(w)}, paint(w, 0)}; },
      [=](StateWorld& w) { return Edited{{move(2, at(3.2, 0.5, 1.1))(w)}, {}}; },
      // One above the other: many segments now hit both.
      [=](StateWorld& w) {
        return Edited{{move(1, at(1.5, 1.3, 1.5))(w), move(2, at(1.55, 0.5, 1.6))(w)}, {}};
      }};
}

/// Segments that are affected, by bounce and slot.
using Slots = std::vector<std::vector<uint32_t>>;
Slots slots_of(const Affected& affected) {
  Slots out;
  for (const auto& segments : affected.segments) {
    out.emplace_back();
    for (const AffectedSegment& segment : segments) out.back().push_back(segment.slot);
  }
  return out;
}

/// Flies every stored segment again. With ends at the first hit, those with another hit are
/// affected, and no others but those that ended on what the edit changes.
void expect_exact(const StateWorld& world, const Edited& edited, const Affected& affected) {
  const State& s = world.s;
  Slots expected(s.paths.store.bounces().size());
  world.each([&](uint32_t bounce, uint32_t slot, const segments::Segment& it) {
    const trace::Hit hit = s.caster->closest(it.origin, decode_direction(it.direction));
    if (edited.touches(s.scene, it.primitive) || hit.primitive != it.primitive) {
      expected[bounce].push_back(slot);
    } else if (hit.valid()) {
      EXPECT_EQ(hit.t, it.length);
    }
  });
  EXPECT_EQ(slots_of(affected), expected);
  size_t known = 0;
  for (uint32_t bounce = 0; bounce < expected.size(); ++bounce)
    for (const AffectedSegment& found : affected.segments[bounce]) {
      const segments::Segment& it = s.paths.store.bounces()[bounce].at(found.slot);
      EXPECT_EQ(found.hit_known, !edited.touches(s.scene, it.primitive));
      if (!found.hit_known) continue;
      const trace::Hit hit = s.caster->closest(it.origin, decode_direction(it.direction));
      EXPECT_EQ(found.hit.primitive, hit.primitive);
      EXPECT_EQ(found.hit.t, hit.t);
      EXPECT_EQ(found.hit.normal, hit.normal);
      EXPECT_EQ(found.hit.u, hit.u);
      ++known;
    }
  const bool moved = edited.materials.empty() && !edited.changes[0].after.empty();
  if (moved) {
    EXPECT_GT(known, 10u);
  }
}

/// With ends behind the first hit, the search may find more than changes, but nothing that neither
/// passes a changed object's box nor ended on what changed.
void expect_enough(const StateWorld& world, const Edited& edited, const Affected& affected) {
  const State& s = world.s;
  const Slots found = slots_of(affected);
  const trace::Walk walk = s.walk();
  world.each([&](uint32_t bounce, uint32_t slot, const segments::Segment& it) {
    const trace::Flight flight{
        it.origin, it.direction, {it.power[0], it.power[1], it.power[2]}, it.path};
    const trace::Interaction now = walk.fly(flight, bounce);
    const float reach = s.paths.store.bounces()[bounce].extended_or_length(slot);
    const bool must = edited.touches(s.scene, it.primitive) || now.primitive != it.primitive ||
                      now.length != it.length || now.extended != reach;
    const Vec3f w = decode_direction(it.direction);
    const auto passes = [&](const ObjectChange& c) {
      return meets(c.before, it.origin, w, reach, 1e-4) ||
             meets(c.after, it.origin, w, reach, 1e-4);
    };
    const bool may = must || std::any_of(edited.changes.begin(), edited.changes.end(), passes);
    const bool is = std::binary_search(found[bounce].begin(), found[bounce].end(), slot);
    EXPECT_TRUE(is || !must) << bounce << " " << slot;
    EXPECT_TRUE(may || !is) << bounce << " " << slot;
  });
  for (const auto& segments : affected.segments)
    for (const AffectedSegment& segment : segments) EXPECT_FALSE(segment.hit_known);
}

/// Near an object are the segments that pass its new box or that of its samples' discs.
void expect_near(const StateWorld& world, const Edited& edited, const Affected& affected) {
  const State& s = world.s;
  ASSERT_EQ(affected.near.size(), edited.changes.size());
  for (size_t k = 0; k < edited.changes.size(); ++k) {
    const ObjectChange& change = edited.changes[k];
    Box box = change.after;
    for (const MovingPart& part : s.discs.moving)
      if (part.object == change.object && !box.empty()) box.grow(part.world);
    size_t passing = 0;
    world.each([&](uint32_t bounce, uint32_t slot, const segments::Segment& it) {
      const std::vector<uint32_t>& near = affected.near[k][bounce];
      const bool is = std::binary_search(near.begin(), near.end(), slot);
      const float reach = s.paths.store.bounces()[bounce].extended_or_length(slot);
      const Vec3f w = decode_direction(it.direction);
      if (meets(box, it.origin, w, reach, -1e-5)) {
        EXPECT_TRUE(is) << bounce << " " << slot;
        ++passing;
      } else if (!meets(box, it.origin, w, reach, 1e-5)) {
        EXPECT_FALSE(is) << bounce << " " << slot;
      }
    });
    EXPECT_EQ(passing > 0, !change.after.empty());
  }
}

/// Replaces the affected paths, and sums the moved objects' samples anew.
void replace(StateWorld& world, const Edited& edited, const Affected& affected) {
  State& s = world.s;
  EditMarks marks(s.paths);
  for (uint32_t bounce = 0; bounce < affected.segments.size(); ++bounce)
    for (const AffectedSegment& it : affected.segments[bounce])
      marks.mark({s.paths.store.bounce(bounce).at(it.slot).path, it.slot, uint8_t(bounce),
                  it.hit_known, it.hit});
  for (MovingPart& part : s.discs.moving) part.current = !edited.changed(part.object);
  PathUpdate update(s);
  update.replace(s.paths.pending, [&] {
    Deposit deposit(s.paths, s.discs);
    for (size_t k = 0; k < edited.changes.size(); ++k)
      for (MovingPart& part : s.discs.moving) {
        if (part.object != edited.changes[k].object) continue;
        s.discs.clear_part(part);
        part.current = true;
        if (!s.scene.objects[part.object].present) continue;
        for (uint32_t bounce = 0; bounce < affected.near[k].size(); ++bounce)
          deposit.add_to_part(part, bounce, affected.near[k][bounce]);
      }
    deposit.finish();
  });
  EXPECT_EQ(update.counts().paths, s.paths.pending.size());
  s.paths.pending.clear();
  EXPECT_EQ(std::count(s.paths.cut.begin(), s.paths.cut.end(), kNotCut), long(s.paths.cut.size()));
}

/// The scan passes over slots that are not in use.
void expect_unused_outlines(const State& s) {
  using segments::BounceSegments, segments::ScanGrid;
  for (const BounceSegments& stored : s.paths.store.bounces())
    for (uint32_t slot = 0; slot < stored.size(); ++slot) {
      if (stored.at(slot).length >= 0) continue;
      EXPECT_EQ(stored.chunk(slot).low[slot % BounceSegments::kChunk], ScanGrid::kUnused.low);
      EXPECT_EQ(stored.chunk(slot).high[slot % BounceSegments::kChunk], ScanGrid::kUnused.high);
    }
}

void follow_edits(const Variant& variant) {
  StateWorld world(variant);
  world.trace();
  size_t edit = 0;
  for (const auto& apply : edits()) {
    SCOPED_TRACE("edit " + std::to_string(edit++));
    const Edited edited = apply(world);
    const Affected affected =
        find_affected(world.s, edited.changes, edited.materials, world.progress);
    if (variant.end == segments::SegmentEnd::first)
      expect_exact(world, edited, affected);
    else
      expect_enough(world, edited, affected);
    expect_near(world, edited, affected);
    size_t slots = 0, found = 0;
    for (const auto& stored : world.s.paths.store.bounces()) slots += stored.size();
    for (const auto& segments : affected.segments) found += segments.size();
    EXPECT_EQ(affected.scanned, slots);
    EXPECT_GT(found, 20u);
    EXPECT_LE(found, affected.candidates);
    EXPECT_LE(affected.candidates, slots);
    replace(world, edited, affected);
    expect_unused_outlines(world.s);
    // As if all had been traced in the new scene.
    StateWorld fresh(variant, world.s.scene);
    fresh.trace();
    EXPECT_TRUE(world.paths() == fresh.paths());
    EXPECT_EQ(world.s.discs.sums, fresh.s.discs.sums);
    EXPECT_EQ(world.s.discs.sums, slow_sums(world));
    if (!variant.gathers) continue;
    EXPECT_EQ(world.s.cells.sums.quanta, fresh.s.cells.sums.quanta);
  }
}

TEST(Affected, AreTheSegmentsWithAnotherHit) { follow_edits({.threads = 1}); }

TEST(Affected, AreTheSegmentsThatPassChangedBoxesIfTheyGoOn) {
  for (const auto end : {segments::SegmentEnd::second, segments::SegmentEnd::bounded})
    follow_edits({.threads = 2, .end = end});
}

TEST(Affected, AreFoundInBlocksThatAreJoinedInOrder) {
  follow_edits({.threads = 3, .gathers = true, .paths = 80000});
}

TEST(Affected, NothingIsWhereNothingChanges) {
  StateWorld world({});
  world.trace();
  const Affected none = find_affected(world.s, {}, {}, world.progress);
  EXPECT_EQ(none.candidates, 0u);
  for (const auto& segments : none.segments) EXPECT_TRUE(segments.empty());
  EXPECT_TRUE(none.near.empty());
  world.progress.cancel();
  EXPECT_THROW(find_affected(world.s, {}, {}, world.progress), Cancelled);
}

TEST(Affected, BoxesAndSamplesOfChangesAreThoseOfTheirObjects) {
  StateWorld world({});
  const Box one{{0, 0, 0}, {1, 1, 1}}, two{{1, 0, 0}, {2, 1, 1}};
  const std::vector<ObjectChange> changes{{2, one, {}}, {1, {}, two}, {2, two, one}};
  const std::vector<Box> boxes = boxes_of(changes);
  ASSERT_EQ(boxes.size(), 4u);
  for (size_t i = 0; i < 4; ++i) EXPECT_EQ(boxes[i].low, (i == 0 || i == 3 ? one : two).low) << i;
  const auto sorted = [](std::vector<uint32_t> ids) {
    std::sort(ids.begin(), ids.end());
    return ids;
  };
  EXPECT_EQ(sorted(moved_samples(world.s, std::span(changes).first(1))),
            (std::vector<uint32_t>{68, 69, 70, 71}));
  EXPECT_EQ(sorted(moved_samples(world.s, std::span(changes).first(2))),
            (std::vector<uint32_t>{64, 65, 66, 67, 68, 69, 70, 71}));
  EXPECT_TRUE(moved_samples(world.s, {}).empty());
}

}  // namespace
}  // namespace deltalux::session
