// SPDX-License-Identifier: Apache-2.0
// The steps of a bake, in the order of the layers.
#include "session/bake/bake.h"

#include <algorithm>

#include "session/bake/choices.h"
#include "session/bake/choose_rays.h"
#include "session/bake/forecast.h"
#include "session/bake/trace_all.h"
#include "session/paths/pilot_paths.h"

namespace deltalux::session {

void gather_light(State& s, Progress& progress, bool new_numbers) {
  if (!s.gathers() || !s.evaluates()) return;
  s.rays.place();
  const std::vector<gather::SeenTargets> seen = s.rays.targets_of_samples(progress);
  if (new_numbers) fit_rays(s);
  s.cells.cover(progress);
  s.rays.hits = s.rays.uncast(seen);
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
  choose_guiding(s, progress);
  frame.end_stage("guides", watch);
  trace_all(s, progress, frame);
  watch.lap();
  leave_direct &=
      s.holds_none() && !s.samples.point.empty() &&
      std::any_of(s.light_sampled.begin(), s.light_sampled.end(), [](uint8_t yes) { return yes; });
  s.direct.compute(progress, leave_direct);
  if (leave_direct) s.sharing.awaited_direct = std::make_unique<Awaited>(s.samples.size());
  frame.end_stage("direct", watch);
  if (s.holds_all()) gather_light(s, progress, true);
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
  s.discs.plan(placed, pilot, true, progress);
  return s.discs.plans;
}

}  // namespace deltalux::session
