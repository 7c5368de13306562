// SPDX-License-Identifier: Apache-2.0
// Sessions that share the paths of one bake: any ranges of them add up to all, bit for bit.
#include <gtest/gtest.h>

#include <algorithm>

#include "base/error.h"
#include "base/fault.h"
#include "memory_archive.h"
#include "session_world.h"

namespace deltalux::session {
namespace {

Options of_range(Options options, uint64_t first, uint64_t last) {
  options.range = PathRange{first, last};
  return options;
}

trace::Light light_of(uint64_t first, uint64_t count) {
  trace::Light light;
  light.first_path = first;
  light.path_count = count;
  return light;
}

TEST(HeldPaths, RangesShareNoPathAndLeaveNoneOut) {
  const std::vector<trace::Light> lights = {light_of(0, 1), light_of(1, 7), light_of(8, 800),
                                            light_of(808, 193), light_of(1001, 64)};
  constexpr uint32_t kAll = 1065;
  for (const std::vector<uint64_t>& cuts : std::vector<std::vector<uint64_t>>{
           {0, 1001}, {0, 500, 1001}, {0, 1, 2, 300, 300, 999, 1001}}) {
    std::vector<int> holders(kAll);
    for (size_t k = 0; k + 1 < cuts.size(); ++k) {
      HeldPaths held({cuts[k], cuts[k + 1]}, 1001, kBatches);
      for (const trace::Light& light : lights) held.add(light);
      for (uint32_t slot = 0; slot < held.size(); ++slot) {
        const uint32_t path = held.path_of(slot);
        ++holders[path];
        EXPECT_EQ(held.slot_of(path), slot);
        EXPECT_EQ(held.find(path), slot);
        if (slot) {
          EXPECT_GT(path, held.path_of(slot - 1));
        }
      }
      uint64_t visited = 0;
      for (const trace::Light& light : lights)
        held.each_of(light, [&](uint64_t i) {
          EXPECT_TRUE(held.find(uint32_t(light.first_path + i)));
          ++visited;
        });
      EXPECT_EQ(visited, held.size());
      uint64_t found = 0;
      for (uint32_t path = 0; path < kAll + 10; ++path) found += held.find(path).has_value();
      EXPECT_EQ(found, held.size());
    }
    EXPECT_EQ(holders, std::vector<int>(kAll, 1));
  }
}

TEST(HeldPaths, EveryRangeTakesTheSameShareOfEveryBatch) {
  const trace::Light light = light_of(40, 8000);
  for (uint64_t k = 0; k < 16; ++k) {
    const HeldPaths held({1000 * k, 1000 * (k + 1)}, 16000, kBatches);
    for (uint32_t batch = 0; batch < kBatches; ++batch) {
      const auto [begin, end] = held.of_batch(light, batch);
      EXPECT_NEAR(double(end - begin), 1000.0 / 16, 1);
      for (uint64_t i = begin; i < end; ++i) EXPECT_EQ(trace::batch_of(light, i, kBatches), batch);
    }
  }
}

TEST(HeldPaths, NumbersAreRoundedDownAndDoNotOverflow) {
  constexpr uint64_t kPaths = 0xfffffff0u;
  const trace::Light light = light_of(0, kPaths);
  const HeldPaths most({1, kPaths - 1}, kPaths, 1);
  EXPECT_EQ(most.of_batch(light, 0), (std::pair<uint64_t, uint64_t>{1, kPaths - 1}));
  // Two batches of 5 paths: from 5 * 3 / 7 up to 5 * 5 / 7 of each.
  const HeldPaths some({3, 5}, 7, 2);
  EXPECT_EQ(some.of_batch(light_of(20, 10), 0), (std::pair<uint64_t, uint64_t>{2, 3}));
  EXPECT_EQ(some.of_batch(light_of(20, 10), 1), (std::pair<uint64_t, uint64_t>{7, 8}));
}

/// Sessions with a range each, and one without paths that evaluates their sums.
class Ranges {
 public:
  Ranges(const scene::Scene& scene, const Options& options, size_t count)
      : whole_(std::make_unique<Session>(scene, some_samples(), of_range(options, 0, 0))) {
    for (size_t k = 0; k < count; ++k)
      parts_.push_back(std::make_unique<Session>(
          scene, some_samples(),
          of_range(options, options.paths * k / count, options.paths * (k + 1) / count)));
  }

  /// Bakes all sessions, but adds nothing up.
  void begin() {
    for (const auto& part : parts_) part->bake(progress_);
    whole_->bake(progress_);
  }

  void bake() {
    begin();
    add_all();
    whole_->exchange().gather(progress_);
  }

  void recompute() {
    for (const auto& part : parts_) part->recompute(progress_);
    whole_->recompute(progress_);
    add_all();
  }

  void update(std::span<const scene::Edit> edits) {
    whole_->update(edits, 0, progress_);
    for (const auto& part : parts_) part->update(edits, 0, progress_);
    add_all();
  }

  /// Saves all sessions and opens them again.
  void reopen() {
    for (auto& part : parts_) reopen(part);
    reopen(whole_);
    add_all();
  }

  /// Makes a part anew of what the session without paths knows, in its present state.
  void lose(size_t number) {
    MemoryArchive archive(whole_->save_choices());
    auto& part = parts_[number];
    part = std::make_unique<Session>(room_with_spot(), some_samples(), part->state().options);
    part->restore(archive, progress_);
    EXPECT_EQ(part->pending_share(), 1);
    part->recompute(progress_);
  }

  /// Expects the results of `one`, which has all paths.
  void expect_those_of(const Session& one) const {
    SegmentsHash hash;
    PathSums sums;
    EnergyAudit audit;
    for (const auto& part : parts_) {
      const SegmentsHash own = part->segments_hash();
      hash = {hash.count + own.count, hash.a + own.a, hash.b + own.b};
      sums.paths += part->exchange().path_sums().paths;
      const EnergyAudit energy = part->audit();
      for (size_t c = 0; c < 3; ++c) audit.emitted[c] += energy.emitted[c];
      for (size_t c = 0; c < 3; ++c) audit.absorbed[c] += energy.absorbed[c];
    }
    const PathSums all = one.exchange().path_sums(), added = whole_->exchange().path_sums();
    EXPECT_EQ(sums.paths, all.paths);
    EXPECT_EQ(added.paths, all.paths);
    EXPECT_EQ(added.discs, all.discs);
    EXPECT_EQ(added.cells, all.cells);
    EXPECT_EQ(hash.count, one.segments_hash().count);
    EXPECT_EQ(whole_->digest(hash), one.digest());
    EXPECT_EQ(audit.emitted, one.audit().emitted);
    EXPECT_EQ(audit.absorbed, one.audit().absorbed);
    EXPECT_EQ(read(*whole_), read(one));
    EXPECT_EQ(whole_->unreached(), one.unreached());
  }

  Session& whole() { return *whole_; }
  Session& part(size_t k) { return *parts_[k]; }

 private:
  static std::pair<std::vector<double>, std::vector<double>> read(const Session& session) {
    std::vector<double> values(3 * session.state().samples.size()), errors(values.size());
    session.read(values.data(), errors.data());
    return {values, errors};
  }
  void add_all() {
    for (const auto& part : parts_)
      whole_->exchange().add_path_changes(part->exchange().path_changes());
  }
  void reopen(std::unique_ptr<Session>& session) {
    MemoryArchive archive(session->save());
    session = std::make_unique<Session>(room_with_spot(), some_samples(), session->state().options);
    session->restore(archive, progress_);
  }

  std::unique_ptr<Session> whole_;
  std::vector<std::unique_ptr<Session>> parts_;
  Progress progress_;
};

const std::vector<std::vector<scene::Edit>> kSteps = {
    {scene::Move{1, at(2.2, 2.1)}},
    {scene::SetPresent{1, false}, scene::Dim{0, 0.5}},
    {scene::SetPresent{1, true}, scene::SetReflectance{0, {0.3f, 0.4f, 0.5f}}},
    {scene::Insert{second_lamp()}},
    {scene::Move{2, at(1, 3)}, scene::Move{1, at(3, 1)}}};

std::vector<Options> some_options() {
  return {options(1, DirectMode::paths, segments::SegmentEnd::bounded),
          options(2, DirectMode::sampled, segments::SegmentEnd::first), gathering(1), gathering(2)};
}

/// More samples than one block of marks has, on the floor and on the box.
samples::SampleSet many_samples() {
  samples::SampleSet set;
  const auto add = [&](uint32_t object, Vec3f corner, float side, int count) {
    for (int i = 0; i < count * count; ++i) {
      const float step = side / float(count);
      set.point.push_back({corner.x + step * (0.5f + float(i % count)), corner.y,
                           corner.z + step * (0.5f + float(i / count))});
      set.normal.push_back({0, 1, 0});
      set.attached.push_back(object);
    }
  };
  add(scene::kNone, {0, 0, 0}, 4, 28);
  add(1, {-0.3f, 0.3f, -0.3f}, 0.6f, 28);
  set.radius.assign(set.point.size(), 0.1f);
  return set;
}

TEST(Ranges, ChangesOfEveryBlockOfSamplesAreTold) {
  Options chosen = options(2, DirectMode::paths, segments::SegmentEnd::bounded);
  chosen.paths = 1000;  // many blocks are left alone
  Session part(room(), many_samples(), of_range(chosen, 200, 700));
  Progress progress;
  part.bake(progress);
  std::vector<int64_t> told;
  const auto expect_told = [&] {
    const SparseRow row = part.exchange().path_changes().discs;
    told.resize(row.size);
    EXPECT_TRUE(std::is_sorted(row.at.begin(), row.at.end()));
    for (size_t i = 0; i < row.at.size(); ++i) told[row.at[i]] += row.value[i];
    EXPECT_EQ(told, part.state().discs.sums);
    return row.at.size();
  };
  EXPECT_GT(expect_told(), 0u);
  const std::vector<std::vector<scene::Edit>> steps = {
      {scene::Move{1, at(2.2, 2.1)}},
      {scene::Move{1, at(3, 1)}},
      {scene::SetPresent{1, false}},  // its samples lose all light
      {scene::Insert{lamp_of_a_new_group()}, scene::SetPresent{1, true}},
      {scene::Move{2, at(1, 3)}, scene::Move{1, at(3, 1)}}};
  for (const auto& edits : steps) {
    part.update(edits, 0, progress);
    Progress cancelled;
    cancelled.cancel();
    EXPECT_THROW(part.recompute(cancelled), Cancelled);
    EXPECT_GT(expect_told(), 0u);
    EXPECT_EQ(expect_told(), 0u);
  }
}

void expect_to_add_up(std::initializer_list<size_t> counts,
                      const scene::Scene& scene = room_with_spot()) {
  for (const Options& chosen : some_options()) {
    Progress progress;
    Session one(scene, some_samples(), chosen);
    one.bake(progress);
    if (chosen.gather_rays) {
      EXPECT_EQ(one.state().rays.guiding.beams.size(), 1u);
    }
    std::vector<std::unique_ptr<Ranges>> shared;
    for (const size_t count : counts)
      shared.push_back(std::make_unique<Ranges>(scene, chosen, count));
    for (const auto& ranges : shared) {
      ranges->bake();
      ranges->expect_those_of(one);
    }
    for (const auto& edits : kSteps) {
      one.update(edits, 0, progress);
      for (const auto& ranges : shared) {
        ranges->update(edits);
        ranges->expect_those_of(one);
      }
    }
    shared.back()->recompute();
    shared.back()->expect_those_of(one);
  }
}

TEST(Ranges, AddUpToASessionWithAllPaths) { expect_to_add_up({3}); }

TEST(Ranges, AddUpToASessionWithAllPathsSlow) { expect_to_add_up({1, 2, 16, 4}); }

TEST(Ranges, AddUpWhereMirrorsAre) { expect_to_add_up({2}, room_with_mirrors()); }

TEST(Ranges, AddUpWherePanesAre) {
  scene::Scene scene = room_with_spot();  // whose objects are those of the edits
  scene.materials.push_back(surfaces::dimming_pane(0.8f));
  // A part of the spot's light passes it, so that asked lights have direct light at two bounces.
  direct::add_quad(scene.objects[0], {2.15f, 0, 0}, {0, 2, 0}, {0, 0, 2.06f}, 2);
  scene.finish();
  expect_to_add_up({2}, scene);
}

TEST(Ranges, EachUpdatesAsItRecomputes) {
  Progress progress;
  for (const Options& chosen : some_options()) {
    Ranges ranges(room_with_spot(), chosen, 4);
    ranges.bake();
    for (const auto& edits : kSteps) {
      Session& part = ranges.part(1);
      part.update(edits, 0, progress);
      const auto updated = part.digest();
      part.recompute(progress);
      EXPECT_EQ(part.digest(), updated);
    }
  }
}

TEST(Ranges, WaitForTheNextCallAsAllPathsDo) {
  Progress progress;
  Ranges ranges(room_with_spot(), gathering(1), 2);
  ranges.bake();
  Session& part = ranges.part(0);
  part.update(kSteps[0], 0.01, progress);
  part.update(kSteps[3], 0.01, progress);
  while (part.update({}, 0.01, progress).done < 1) continue;
  const auto updated = part.digest();
  part.recompute(progress);
  EXPECT_EQ(part.digest(), updated);
}

/// What the call refuses, in words; "" if it succeeds.
template <class Call>
std::string refusal(const Call& call) {
  try {
    call();
  } catch (const OptionError& error) {
    return error.what();
  }
  return "";
}

template <class Call>
void refused(const Call& call, const std::string& expected) {
  const std::string found = refusal(call);
  EXPECT_NE(found.find(expected), std::string::npos) << found;
}

TEST(Ranges, RefuseWhatTheyCannotDo) {
  Progress progress;
  for (const PathRange range : {PathRange{3, 2}, PathRange{0, 4001}})
    refused(
        [&] {
          Session session(room(), some_samples(), of_range(gathering(1), range.first, range.last));
        },
        "path_range: found");
  Ranges ranges(room_with_spot(), gathering(1), 2);
  Session &whole = ranges.whole(), &part = ranges.part(0);
  std::vector<double> values(3 * some_samples().size());
  whole.bake(progress);
  part.bake(progress);
  const auto read = [&](Session& session) { session.read_irradiance(values.data()); };
  refused([&] { read(part); }, "holds paths 0 to 2000 of 4000");
  refused([&] { read(whole); },
          "found the sums of 0 paths after 0 edits, expected those of all 4000");
  refused([&] { whole.exchange().gather(progress); }, "found the sums of 0 paths");
  refused([&] { whole.update(kSteps[0], 0, progress); }, "call gather()");
  refused([&] { whole.recompute(progress); }, "call gather()");
  refused([&] { whole.save(); }, "call gather()");
  refused([&] { part.exchange().add_path_changes({}); }, "expected a baked one of path_range");
  refused([&] { whole.exchange().path_changes(); },
          "found a session that is not baked or evaluates light");
  refused([&] { part.exchange().gather(progress); }, "expected a baked one of path_range");
  const PathChanges all = part.exchange().path_changes();
  PathChanges wrong = all;
  --wrong.discs.size;
  refused([&] { whole.exchange().add_path_changes(wrong); }, "discs: found changes of");
  wrong = all, wrong.cells.at.back() = wrong.cells.size;
  refused([&] { whole.exchange().add_path_changes(wrong); }, "cells: found places beyond the end");
  ranges.bake();
  refused([&] { whole.exchange().add_path_changes(all); }, "some are added already");
  refused([&] { whole.digest(); }, "segments_hash");
  std::vector<double> slopes(9 * some_samples().size());
  refused([&] { whole.read_gradient(slopes.data(), progress); }, "gradient: ");
  read(whole);
}

TEST(Ranges, RefuseToBeReadBeforeAllChangesOfAllEditsAreAdded) {
  Progress progress;
  Ranges ranges(room_with_spot(), gathering(1), 2);
  ranges.bake();
  Session &whole = ranges.whole(), &one = ranges.part(0), &two = ranges.part(1);
  const auto add = [&](const PathChanges& changes) {
    return refusal([&] { whole.exchange().add_path_changes(changes); });
  };
  std::vector<double> values(3 * some_samples().size());
  const auto read = [&] { return refusal([&] { whole.read_irradiance(values.data()); }); };
  EXPECT_EQ(read(), "");
  for (Session* session : {&whole, &one, &two}) session->update(kSteps[0], 0, progress);
  EXPECT_NE(read().find("the sums of 0 paths after 1 edits"), std::string::npos) << read();
  const PathChanges first = one.exchange().path_changes();
  EXPECT_EQ(add(first), "");
  EXPECT_EQ(read().find("the sums of 0 paths"), std::string::npos);
  EXPECT_NE(read().find("after 1 edits, expected those of all 4000"), std::string::npos);
  EXPECT_NE(add(first).find("some are added already"), std::string::npos);
  // Nothing more to tell is no second answer.
  const PathChanges nothing = one.exchange().path_changes();
  EXPECT_TRUE(nothing.ranges.empty());
  EXPECT_TRUE(nothing.discs.at.empty() && nothing.cells.at.empty());
  EXPECT_EQ(add(nothing), "");
  EXPECT_NE(read(), "");
  // A part that is an edit ahead, or behind, is not of this state.
  const PathChanges second = two.exchange().path_changes();
  whole.update(kSteps[2], 0, progress);
  EXPECT_NE(add(second).find("found changes from edit 0 to edit 1, expected those from edit 0 to "
                             "edit 3"),
            std::string::npos)
      << add(second);
  for (Session* session : {&one, &two}) session->update(kSteps[2], 0, progress);
  // The sums were never complete at edit 1: what one told since then lacks what two did not add.
  EXPECT_NE(add(one.exchange().path_changes()).find("found changes from edit 1 to edit 3"),
            std::string::npos);
  EXPECT_NE(read(), "");
}

TEST(Ranges, ChangesWithinABudgetAreAddedAsTheyCome) {
  Progress progress;
  Ranges ranges(room_with_spot(), gathering(1), 1);
  ranges.bake();
  Session one(room_with_spot(), some_samples(), gathering(1));
  one.bake(progress);
  one.update(kSteps[3], 0, progress);
  Session& part = ranges.part(0);
  ranges.whole().update(kSteps[3], 0, progress);
  part.update(kSteps[3], 0.01, progress);
  int calls = 0;
  for (bool again = true; again; ++calls) {
    ranges.whole().exchange().add_path_changes(part.exchange().path_changes());
    again = part.pending_share() > 0;
    if (again) part.update({}, 0.01, progress);
  }
  EXPECT_GT(calls, 1);
  ranges.expect_those_of(one);
}

/// After an edit, calls disturb(ranges), which must change nothing, not for later edits either.
template <class Disturb>
void expect_unchanged_by(const Disturb& disturb) {
  Progress progress;
  for (const Options& chosen : some_options()) {
    Session one(room_with_spot(), some_samples(), chosen);
    one.bake(progress);
    one.update(kSteps[0], 0, progress);
    Ranges ranges(room_with_spot(), chosen, 2);
    ranges.bake();
    ranges.update(kSteps[0]);
    disturb(ranges);
    ranges.expect_those_of(one);
    one.update(kSteps[2], 0, progress);
    ranges.update(kSteps[2]);
    ranges.expect_those_of(one);
  }
}

TEST(Ranges, AreTracedAgainFromTheChoicesOfABake) {
  expect_unchanged_by([](Ranges& ranges) {
    const PathSums before = ranges.part(1).exchange().path_sums();
    ranges.lose(1);
    ranges.part(1).exchange().path_changes();  // were added by the one that is lost
    EXPECT_EQ(ranges.part(1).exchange().path_sums().discs, before.discs);
    EXPECT_EQ(ranges.part(1).exchange().path_sums().cells, before.cells);
  });
}

TEST(Ranges, ComputeTheOpennessOfTheirShareOfTheSamples) {
  Progress progress;
  const Options chosen = options(1, DirectMode::paths, segments::SegmentEnd::first);
  Session one(room_with_spot(), some_samples(), chosen);
  one.bake(progress);
  const std::vector<float>& expected = one.state().discs.openness;
  const auto near = std::find_if(expected.begin(), expected.end(), [](float o) { return o != 1; });
  ASSERT_NE(near, expected.end());
  Ranges ranges(room_with_spot(), chosen, 3);
  ranges.begin();
  EXPECT_EQ(ranges.whole().state().discs.openness, std::vector<float>(expected.size(), 1.0f));
  // One that is lost before it told anything is made of choices that lack openness.
  const auto place = size_t(near - expected.begin());
  for (size_t k = 0; k < 3; ++k)
    if (place < ranges.part(k).state().own_samples().second) {
      ranges.lose(k);
      break;
    }
  std::vector<PathChanges> told;
  size_t next = 0;
  for (size_t k = 0; k < 3; ++k) {
    told.push_back(ranges.part(k).exchange().path_changes());
    for (const uint64_t at : told[k].openness.at) EXPECT_EQ(at, next++);
  }
  EXPECT_EQ(next, expected.size());
  PathChanges wrong = told[0];
  const auto refused = [&](const char* said) {
    const std::string found = refusal([&] { ranges.whole().exchange().add_path_changes(wrong); });
    EXPECT_NE(found.find(said), std::string::npos) << found;
  };
  wrong.openness.value[0] = 0x7fc00000;  // NaN
  refused("openness: found numbers that are none");
  wrong.openness = {};
  refused("openness: found changes of 0 numbers");
  for (const PathChanges& each : told) ranges.whole().exchange().add_path_changes(each);
  EXPECT_EQ(ranges.whole().state().discs.openness, expected);
  EXPECT_EQ(ranges.whole().state().discs.area, one.state().discs.area);
  ranges.expect_those_of(one);
  EXPECT_EQ(ranges.part(0).exchange().path_changes().openness.size, 0u);
  ranges.recompute();
  ranges.expect_those_of(one);
  ranges.reopen();
  ranges.expect_those_of(one);
}

void expect_cancelled_looks_to_leave_everything(int64_t most_tried) {
  Progress progress;
  Session one(room_with_spot(), some_samples(), gathering(1));
  one.bake(progress);
  const Options all = of_range(gathering(1), 0, gathering(1).paths);
  Session part(room_with_spot(), some_samples(), all);
  part.bake(progress);
  const PathChanges told = part.exchange().path_changes();
  const auto whole = [&] {
    auto out = std::make_unique<Session>(room_with_spot(), some_samples(), of_range(all, 0, 0));
    out->bake(progress);
    out->exchange().add_path_changes(told);
    return out;
  };
  // Count the checks of a look; then cancel at some of them, the last ones too.
  constexpr int64_t kMany = 1 << 30;
  const auto counted = whole();
  fault::arm(fault::Kind::cancel, kMany);
  counted->exchange().gather(progress);
  const int64_t checks = kMany - fault::countdown[size_t(fault::Kind::cancel)];
  fault::arm(fault::Kind::cancel, 0);
  EXPECT_GT(checks, 50);
  const auto session = whole();
  const PathSums before = session->exchange().path_sums();
  const size_t forecast = session->forecast().bytes;
  for (int64_t check = checks; check > 0; check -= 1 + checks / most_tried) {
    fault::arm(fault::Kind::cancel, check);
    EXPECT_THROW(session->exchange().gather(progress), Cancelled) << check;
    fault::arm(fault::Kind::cancel, 0);
    EXPECT_EQ(session->exchange().path_sums().cells, before.cells);
    EXPECT_EQ(session->forecast().bytes, forecast);
    EXPECT_FALSE(session->state().rays.all_cast());
  }
  session->exchange().gather(progress);
  EXPECT_EQ(session->digest(part.segments_hash()), one.digest());
}

TEST(Ranges, ACancelledLookLeavesEverythingAsItWas) {
  expect_cancelled_looks_to_leave_everything(5);
}

TEST(Ranges, ACancelledLookLeavesEverythingAsItWasSlow) {
  expect_cancelled_looks_to_leave_everything(30);
}

TEST(Ranges, ALightGroupThatFailedToComeChangesNothingThatIsTold) {
  Progress progress;
  const Options options = of_range(gathering(1), 0, 2000);
  const auto told = [&] {
    auto out = std::make_unique<Session>(room(), some_samples(), options);
    out->bake(progress);
    out->exchange().path_changes();
    return out;
  };
  const std::vector<scene::Edit> insert{scene::Insert{lamp_of_a_new_group()}};
  const std::vector<scene::Edit> move{scene::Move{1, at(2.5, 2)}};
  const auto expected = told();
  expected->update(move, 0, progress);
  const PathChanges without = expected->exchange().path_changes();
  int failures = 0;
  for (const fault::Kind kind : {fault::Kind::cancel, fault::Kind::commit})
    for (int64_t k = 1;; ++k) {
      const auto session = told();
      fault::arm(kind, k);
      try {
        session->update(insert, 0, progress);
      } catch (const std::exception&) {
      }
      const bool came = fault::countdown[size_t(kind)] <= 0;
      fault::arm(kind, 0);
      if (!came) break;
      if (session->state().scene.group_count > 1) continue;  // the edit took effect before
      ++failures;
      EXPECT_EQ(session->state().group_factor.size(), 1u);
      session->update(move, 0, progress);
      const PathChanges found = session->exchange().path_changes();
      EXPECT_EQ(found.cells.at, without.cells.at);
      EXPECT_EQ(found.cells.value, without.cells.value);
    }
  EXPECT_GT(failures, 2);
}

TEST(Ranges, ComeBackFromArchives) {
  expect_unchanged_by([](Ranges& ranges) { ranges.reopen(); });
}

}  // namespace
}  // namespace deltalux::session
