// SPDX-License-Identifier: Apache-2.0
// The steps of a bake, in the order of the layers.
#include "session/bake/bake.h"

#include <algorithm>

#include "base/assertion.h"
#include "session/bake/choice_light.h"
#include "session/bake/choose_guides.h"
#include "session/bake/choose_rays.h"
#include "session/bake/forecast.h"
#include "session/flow/path_update.h"
#include "session/paths/pilot_paths.h"

namespace deltalux::session {
namespace {

constexpr uint64_t kSlotsPerStep = 65536;  // slots allocated between two checks for cancellation

/// Traces all paths, in steps that each take the same share of every batch.
PathCounts trace_lights(State& s, Progress& progress) {
  const uint64_t total = s.paths.cut.size();
  std::vector<uint32_t> slots;
  for (uint64_t done = 0; done < total; done += slots.size()) {
    progress.check();
    s.paths.store.bounce(0).allocate(std::min(total - done, kSlotsPerStep), s.paths.store.extras(),
                                     slots);
  }
  PathUpdate update(s);
  const uint64_t steps = (total + kPathsPerStep - 1) / kPathsPerStep;
  for (uint64_t step = 0; step < steps; ++step) {
    slots.clear();
    for (const trace::Light& light : s.lights) {
      // Each batch contributes the same share to every step.
      for (uint32_t batch = 0; batch < kBatches; ++batch) {
        const auto [from, end] = s.paths.held.of_batch(light, batch);
        const uint64_t count = end - from;
        const uint64_t first = count * step / steps, last = count * (step + 1) / steps;
        if (first == last) continue;
        const uint32_t slot = s.paths.held.slot_of(uint32_t(light.first_path + from));
        for (uint64_t i = first; i < last; ++i) slots.push_back(uint32_t(slot + i));
      }
    }
    update.start(slots, progress);
    progress.advance(slots.size());
  }
  return update.counts();
}

void trace_all(State& s, Progress& progress, Frame& frame) {
  s.paths.prepare();
  s.discs.clear_sums();
  s.sharing.added.clear();
  s.sharing.added_since.reset();
  s.sharing.sent.reset();
  const uint64_t paths = s.paths.held.size();
  progress.begin("trace paths", paths);
  const PathCounts counts = trace_lights(s, progress);
  DELTALUX_ASSERT(
      std::all_of(s.discs.sums.begin(), s.discs.sums.end(), [](int64_t sum) { return sum >= 0; }));
  frame.retraced_segments = counts.retraced;
  frame.affected_paths = paths;
  frame.milliseconds.emplace_back("trace", counts.trace_ms);
  frame.milliseconds.emplace_back("deposit", counts.deposit_ms);
}

}  // namespace

void gather_light(State& s, Progress& progress, bool new_guides, const FirstFlights& others,
                  const std::function<void()>& chosen) {
  if (!s.gathers() || !s.evaluates()) return;
  s.cells.cover(progress);
  if (new_guides) {
    const ChoiceLight choice(s, choice_factors(s));
    const gather::Evaluation now = choose_guides(s, others, progress);
    if (chosen) chosen();
    const std::vector<gather::SeenTargets> seen = s.rays.targets_of_samples(progress);
    choose_rays(s, now, seen, progress);
    s.rays.hits = s.rays.uncast(seen);
  } else {
    s.rays.place();
    s.rays.hits = s.rays.uncast(s.rays.targets_of_samples(progress));
  }
  s.rays.cast(progress);
}

Frame bake(State& s, Progress& progress, bool leave_direct) {
  Frame frame;
  Stopwatch watch;
  s.index_triangles(progress);
  s.cells.divide(progress);
  s.allot_paths(progress);
  s.paths.held = s.held();
  s.cells.lay_out_sums();
  const PilotPaths pilot = walk_pilot_paths(s, progress);
  forecast_memory(s, pilot);
  s.choose_direct(double(s.forecast.segments));
  refuse_beyond_limit(s);
  PlacedDiscs placed;
  if (s.counts_in_discs()) {
    s.resolve_radii(progress);
    placed = s.discs.place(progress);
  }
  s.discs.take(placed);
  frame.end_stage("prepare", watch);
  s.discs.plan(placed, pilot, false, progress);
  s.discs.make_estimators(placed, progress);
  frame.end_stage("plan", watch);
  trace_all(s, progress, frame);
  watch.lap();
  leave_direct &=
      s.holds_none() && !s.samples.point.empty() &&
      std::any_of(s.light_sampled.begin(), s.light_sampled.end(), [](uint8_t yes) { return yes; });
  s.direct.compute(progress, leave_direct);
  if (leave_direct) s.sharing.awaited_direct = std::make_unique<Awaited>(s.samples.size());
  frame.end_stage("direct", watch);
  if (s.holds_all()) gather_light(s, progress, true, {}, [&] { frame.end_stage("guides", watch); });
  frame.end_stage("gather", watch);
  s.discs.refresh_areas(nullptr);
  return frame;
}

Frame recompute(State& s, Progress& progress) {
  for (trace::Light& light : s.lights) trace::place_light(s.scene, light);
  Frame frame;
  progress.begin("index triangles", 1);
  s.caster = std::make_unique<trace::RayCaster>(s.scene, progress);
  s.cells.divide(progress);
  trace_all(s, progress, frame);
  Stopwatch watch;
  s.direct.compute(progress);
  frame.end_stage("direct", watch);
  gather_light(s, progress);
  frame.end_stage("gather", watch);
  s.discs.refresh_areas(nullptr);
  return frame;
}

void rebuild(State& s, Progress& progress) {
  s.damaged = true;
  s.step = Step::rest;  // wherever the update failed
  Frame frame;
  Progress unstoppable;
  s.paths.pending.clear();
  progress.announce("compute again", 1);
  s.cells.divide(unstoppable);
  s.rays.clear();
  s.images.kept.reset();
  trace_all(s, unstoppable, frame);
  s.direct.compute(unstoppable);
  gather_light(s, unstoppable);
  s.discs.refresh_areas(nullptr);
  s.damaged = false;
}

const std::vector<plan::PartPlan>& plan_parts(State& s, Progress& progress) {
  // Openness takes longer to compute than everything else here, and no cost depends on it.
  const std::vector<float> open(s.samples.size(), 1.0f);
  s.index_triangles(progress);
  s.resolve_radii(progress);
  PlacedDiscs placed = s.discs.place(progress, open);
  s.discs.take(placed);
  s.allot_paths(progress);
  s.paths.held = s.held();
  const PilotPaths pilot = walk_pilot_paths(s, progress);
  forecast_memory(s, pilot);
  s.choose_direct(double(s.forecast.segments));
  s.discs.plan(placed, pilot, true, progress);
  return s.discs.plans;
}

}  // namespace deltalux::session
