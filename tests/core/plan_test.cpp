// SPDX-License-Identifier: Apache-2.0
// The planner's parts: a pilot of all segments counts what the methods count, one of a hundredth
// predicts it; constants are found again from times made of them; the choice follows the figures.
#include <gtest/gtest.h>

#include "plan/calibration_world.h"
#include "plan/fit.h"
#include "plan/planner.h"

namespace deltalux::plan {
namespace {

using segments::SegmentEnd;

const Workers kOne(1);

/// Every pilot of the chords, as one call of so many segments.
Counts count(Method method, const samples::DiscSet& discs, const SegmentSample& sample,
             double segments) {
  Pilot pilot(discs, SegmentEnd::first, kOne);
  return pilot.count(method, sample, {segments, segments});
}

TEST(Plan, PilotOfAllSegmentsCountsWhatTheMethodsCount) {
  const SegmentSample chords = make_chords(3000);
  const samples::DiscSet discs = scatter_in_volume(700, 0.05f);
  ScratchSums sums(discs);
  const estimate::DiscIndex index(discs, SegmentEnd::first, kOne);
  const estimate::SphereCache cache(discs, {.rule = SegmentEnd::first});
  const auto all = double(chords.count());
  EXPECT_EQ(count(Method::disc_index, discs, chords, all), search(index, chords.span(), sums));
  EXPECT_EQ(count(Method::sphere_cache, discs, chords, all),
            search(cache, chords.span(), 1, sums, kOne));
  EXPECT_EQ(count(Method::ray_map, discs, chords, all),
            search_ray_map(discs, SegmentEnd::first, 32, chords.span(), sums));
  Counts pairs = search_brute_force(discs, SegmentEnd::first, chords.span(), sums);
  EXPECT_GT(pairs[kHits], 100);
  pairs[kHits] = 0;  // the one count that takes a run
  EXPECT_EQ(count(Method::brute_force, discs, chords, all), pairs);
}

// Of 400000 chords 4096 are taken. At random, they would have a standard error of about 1.6 % in
// tests; spread evenly along a curve, a quarter of it. Rebuilds have no such error, but lists near
// their least length are judged by those around them, which costs some per cent.
TEST(Plan, PilotOfAHundredthPredictsTheTests) {
  const SegmentSample chords = make_chords(400000);
  const samples::DiscSet discs = scatter_in_volume(500, 0.07f);
  ScratchSums sums(discs);
  const estimate::DiscIndex index(discs, SegmentEnd::first, kOne);
  const estimate::SphereCache cache(discs, {.rule = SegmentEnd::first});
  const auto all = double(chords.count());
  const Counts by_index = search(index, chords.span(), sums);
  const Counts by_cache = search(cache, chords.span(), 1, sums, kOne);
  const Counts few_index = count(Method::disc_index, discs, chords, all);
  const Counts few_cache = count(Method::sphere_cache, discs, chords, all);
  for (const Count kind : {kNodeTests, kDiscTests})
    EXPECT_NEAR(few_index[kind] / by_index[kind], 1, 0.02) << int(kind);
  for (const Count kind : {kSphereTests, kFarTests, kDiscTests, kFarHits})
    EXPECT_NEAR(few_cache[kind] / by_cache[kind], 1, 0.02) << int(kind);
  EXPECT_NEAR(few_cache[kRebuilds] / by_cache[kRebuilds], 1, 0.1);
}

// Every hit on a circle asks for the outline, in the ray map once in each leaf that it passes.
TEST(Plan, OutlineTestsAreHitsOnTheCirclesOfClippedDiscs) {
  const SegmentSample chords = make_chords(3000);
  const samples::DiscSet whole = scatter_in_volume(700, 0.05f);
  const samples::DiscSet some = clipped_below(0.3f, whole);
  ScratchSums sums(whole);
  const auto by_index = [&](const samples::DiscSet& discs) {
    return search(estimate::DiscIndex(discs, SegmentEnd::first, kOne), chords.span(), sums);
  };
  const Counts before = by_index(whole), after = by_index(some);
  double circles = 0;
  for (size_t i = 0; i < whole.size(); ++i) {
    if (some.outline[i] == samples::kWholeDisc) continue;
    samples::DiscSet one;
    one.centre = {whole.centre[i]}, one.normal = {whole.normal[i]}, one.radius = {whole.radius[i]};
    one.outline = {samples::kWholeDisc}, one.id = {0};
    circles += search_brute_force(one, SegmentEnd::first, chords.span(), sums)[kHits];
  }
  EXPECT_GT(circles, 100);
  EXPECT_EQ(before[kOutlineTests], 0);
  EXPECT_EQ(after[kOutlineTests], circles);
  const double lost = before[kHits] - after[kHits];  // half of each outline lies inside the circle
  EXPECT_GT(lost, 0.2 * circles);
  EXPECT_LT(lost, 0.6 * circles);
  const estimate::SphereCache cache(some, {.rule = SegmentEnd::first});
  EXPECT_EQ(search(cache, chords.span(), 1, sums, kOne)[kOutlineTests], circles);
  const Counts map = search_ray_map(some, SegmentEnd::first, 32, chords.span(), sums);
  EXPECT_GE(map[kOutlineTests], circles);
  EXPECT_EQ(map[kHits], after[kHits]);
}

TEST(Plan, FarCountsAreWeighedByDoublings) {
  constexpr uint64_t kHeld = uint64_t(kNear);
  estimate::Stats stats;
  stats.hits = 10;
  estimate::SphereLevels levels;
  levels.tests = {0, 3 * 4 * kHeld, 5 * kHeld / 2, 0};  // lists of four times what fits, of half
  levels.rebuilds = {0, 3, 5, 0};
  const Counts all = counts_of(stats, levels, 8 * kHeld, 1);
  EXPECT_DOUBLE_EQ(all[kFarTests], 2.0 * 3 * 4 * kHeld);
  EXPECT_DOUBLE_EQ(all[kFarHits], 3.0 * 10);
  EXPECT_DOUBLE_EQ(all[kRebuilds], 8);
  // Of four times as many: two doublings more, where the half becomes one.
  const Counts quarter = counts_of(stats, levels, 8 * kHeld, 0.25);
  EXPECT_DOUBLE_EQ(quarter[kFarTests], 4.0 * 3 * 4 * kHeld + 1.0 * 5 * kHeld / 2);
  EXPECT_DOUBLE_EQ(quarter[kFarHits], 5.0 * 10);
  const Counts few = counts_of(stats, levels, kHeld, 1);
  EXPECT_EQ(few[kFarHits], 0);
}

TEST(Plan, CallsOfSpansAddUp) {
  const SegmentSample chords = make_chords(2000);
  const samples::DiscSet discs = scatter_on_walls(300, 1);
  Pilot pilot(discs, SegmentEnd::first, kOne);
  const Counts one = pilot.count(Method::sphere_cache, chords, {2000, 2000});
  const Counts five = pilot.count(Method::sphere_cache, chords, {10000, 2000});
  for (size_t i = 0; i < kCounts; ++i) EXPECT_DOUBLE_EQ(five[i], 5 * one[i]) << i;
}

TEST(Plan, BoundsAreNoMoreThanCounts) {
  const SegmentSample chords = make_chords(2000);
  Pilot pilot(scatter_in_volume(400, 0.05f), SegmentEnd::first, kOne);
  const Load load{50000, 2000};
  for (const Method method : kMethods) {
    const Counts least = pilot.least(method, load), counts = pilot.count(method, chords, load);
    for (size_t i = 0; i < kCounts; ++i) EXPECT_LE(least[i], counts[i] * 1.0001) << i;
  }
}

TEST(Plan, ReleasedEstimatorsHaveTheDiscs) {
  for (const Method method : kMethods) {
    Pilot pilot(scatter_in_volume(50, 0.1f), SegmentEnd::first, kOne);
    pilot.count(Method::disc_index, make_chords(10), {10, 10});
    EXPECT_EQ(pilot.release(method)->discs().size(), 50u);
  }
}

TEST(Plan, FitFindsConstantsAgain) {
  const Counts prior = typical_machine()[size_t(Method::sphere_cache)].front().seconds;
  Counts truth = prior;
  truth[kSphereTests] *= 2, truth[kRebuilds] *= 0.5;
  std::vector<Timed> searches;
  const auto kinds = {kSegments, kVisits, kDiscTests, kSphereTests, kRebuilds, kHits};
  // Searches in which one kind prevails, and one of all.
  for (const Count kind : kinds) {
    Timed search;
    for (const Count other : kinds) search.counts[other] = (other == kind ? 100 : 1) / prior[other];
    search.seconds = search_seconds(search.counts, {1, truth, 0});
    searches.push_back(search);
  }
  const Counts found = fit_constants(searches, prior);
  for (const Count kind : kinds) EXPECT_NEAR(found[kind] / truth[kind], 1, 0.06) << int(kind);
  EXPECT_EQ(found[kNodeTests], 0);
}

TEST(Plan, ConstantsBetweenSizesAndBeyond) {
  MethodConstants rows(2);
  rows[0] = {1e3, {}, 1}, rows[1] = {1e5, {}, 3};
  rows[0].seconds[kHits] = 4, rows[1].seconds[kHits] = 2;
  EXPECT_DOUBLE_EQ(constants_at(rows, 10).build, 1);
  EXPECT_DOUBLE_EQ(constants_at(rows, 1e4).build, 2);
  EXPECT_DOUBLE_EQ(constants_at(rows, 1e6).build, 4);
  EXPECT_DOUBLE_EQ(constants_at(rows, 1e4).seconds[kHits], 3);
  EXPECT_DOUBLE_EQ(constants_at(rows, 1e7).seconds[kHits], 2);  // never below the last one
}

Traffic traffic_of(double segments, double frames) {
  Traffic traffic;
  traffic.sample = make_chords(2000);
  traffic.bake = traffic.frame = {segments, segments};
  traffic.frames = frames;
  return traffic;
}

PartPlan plan_for(size_t discs, const Traffic& traffic, bool thorough,
                  Policy policy = Policy::measured, const Machine& machine = typical_machine()) {
  Pilot pilot(scatter_on_walls(discs, 1), SegmentEnd::first, kOne);
  return plan_part(pilot, traffic, policy, machine, thorough);
}

TEST(Plan, ChoosesTheSameWithAllPilotsAndWithFewNearlyTheCheapest) {
  for (const size_t discs : {1, 30, 3000, 100000})
    for (const double segments : {1.0, 300.0, 100000.0})
      for (const double frames : {0.0, 100.0}) {
        const Traffic traffic = traffic_of(segments, frames);
        const PartPlan few = plan_for(discs, traffic, false), all = plan_for(discs, traffic, true);
        const double least = all.methods.front().seconds(frames, false);
        EXPECT_EQ(all.chosen, few.chosen);
        for (const MethodPlan& m : all.methods) {
          EXPECT_TRUE(m.piloted);
          EXPECT_LE(least, m.seconds(frames, false));
          if (m.method != few.chosen) continue;
          EXPECT_LE(0.9 * m.seconds(frames, false), least)
              << discs << " discs, " << segments << " segments, " << frames << " frames";
        }
      }
}

TEST(Plan, AnIndexPaysWithFramesUnlessItIsRebuilt) {
  Traffic traffic = traffic_of(200, 0);
  EXPECT_NE(plan_for(100000, traffic, true).chosen, Method::disc_index);
  traffic.frames = 1000;
  EXPECT_EQ(plan_for(100000, traffic, true).chosen, Method::disc_index);
  traffic.rebuilds = true;
  EXPECT_NE(plan_for(100000, traffic, true).chosen, Method::disc_index);
}

TEST(Plan, AllMethodsHaveTheHitsOfTheIndex) {
  const PartPlan plan = plan_for(300, traffic_of(3000, 10), true);
  const auto of = [&](Method method) {
    return std::ranges::find(plan.methods, method, &MethodPlan::method)->bake;
  };
  EXPECT_GT(of(Method::disc_index)[kHits], 100);
  EXPECT_EQ(of(Method::brute_force)[kHits], of(Method::disc_index)[kHits]);
  EXPECT_EQ(of(Method::sphere_cache)[kHits], of(Method::disc_index)[kHits]);
}

TEST(Plan, NoMethodSearchesFasterThanAnIndexThatIsThere) {
  Machine machine = typical_machine();
  for (Constants& constants : machine[size_t(Method::sphere_cache)])
    for (double& seconds : constants.seconds) seconds *= 0.01;
  Traffic traffic = traffic_of(100000, 100);
  for (const bool thorough : {false, true}) {
    const PartPlan kept = plan_for(1000, traffic, thorough, Policy::measured, machine);
    EXPECT_EQ(kept.chosen, Method::disc_index);
  }
  traffic.rebuilds = true;
  const PartPlan rebuilt = plan_for(1000, traffic, true, Policy::measured, machine);
  EXPECT_EQ(rebuilt.chosen, Method::sphere_cache);
}

TEST(Plan, PaperRuleGoesBySize) {
  Traffic traffic = traffic_of(1000, 10);
  traffic.size_by_sphere = 0.3, traffic.size_by_box = 0.4;
  EXPECT_EQ(plan_for(100, traffic, false, Policy::paper_sphere).chosen, Method::disc_index);
  traffic.moving = true;
  EXPECT_EQ(plan_for(100, traffic, false, Policy::paper_sphere).chosen, Method::sphere_cache);
  EXPECT_EQ(plan_for(100, traffic, false, Policy::paper_box).chosen, Method::disc_index);
}

}  // namespace
}  // namespace deltalux::plan
