// SPDX-License-Identifier: Apache-2.0
// Bake and recompute: computes all sums of a scene from scratch.
#include "session/session.h"

#include <algorithm>
#include <utility>

#include "base/assertion.h"
#include "base/error.h"
#include "session/paths/pilot_paths.h"
#include "session/session_forecast.h"

namespace deltalux::session {
namespace {

constexpr uint64_t kSlotsPerStep = 65536;  // slots allocated between two checks for cancellation

}  // namespace

Session::Session(scene::Scene scene, samples::SampleSet samples, const Options& options)
    : state_(std::make_unique<State>(std::move(scene), std::move(samples), options)) {}

Session::~Session() = default;

void Session::trace_all(Progress& progress, Frame& frame) {
  State& s = *state_;
  s.paths.prepare();
  s.discs.clear_sums();
  s.added.clear();
  s.added_since.reset();
  told_.reset();
  const uint64_t paths = s.paths.held.size();
  progress.begin("trace paths", paths);
  const PathCounts counts = trace_lights(progress);
  DELTALUX_ASSERT(
      std::all_of(s.discs.sums.begin(), s.discs.sums.end(), [](int64_t sum) { return sum >= 0; }));
  frame.retraced_segments = counts.retraced;
  frame.affected_paths = paths;
  frame.milliseconds.emplace_back("trace", counts.trace_ms);
  frame.milliseconds.emplace_back("deposit", counts.deposit_ms);
}

PathCounts Session::trace_lights(Progress& progress) {
  State& s = *state_;
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

std::unique_ptr<State> Session::unbaked() const {
  auto fresh = std::make_unique<State>(state_->options);
  fresh->take_given(*state_);
  return fresh;
}

void Session::forget_bake() {
  std::unique_ptr<State> old = std::exchange(state_, unbaked());
  kept_.reset(), told_.reset(), looking_.reset();
  awaited_direct_.reset();
  baked_ = damaged_ = false;
  dispose(std::move(old));
}

Frame Session::replace(std::unique_ptr<State> fresh, const std::function<Frame()>& compute) {
  std::swap(state_, fresh);
  auto old_told = std::move(told_);
  auto old_looking = std::move(looking_);
  auto old_awaited = std::move(awaited_direct_);
  try {
    Frame frame = compute();
    baked_ = true;
    damaged_ = false;
    return frame;
  } catch (...) {
    std::swap(state_, fresh);
    told_ = std::move(old_told);
    looking_ = std::move(old_looking);
    awaited_direct_ = std::move(old_awaited);
    dispose(std::move(fresh));
    throw;
  }
}

Frame Session::bake(Progress& progress, bool leave_direct) {
  return replace(unbaked(), [&] {
    Frame frame;
    Stopwatch watch;
    State& s = *state_;
    s.index_triangles(progress);
    make_cells(progress);
    s.allot_paths(progress);
    s.paths.held = s.held();
    lay_out_cell_sums(s);
    const PilotPaths pilot = walk_pilot_paths(s, progress);
    forecast_memory(pilot);
    s.choose_direct(double(forecast_.segments));
    refuse_beyond_limit();
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
    trace_all(progress, frame);
    watch.lap();
    leave_direct &= s.holds_none() && !s.samples.point.empty() &&
                    std::any_of(s.light_sampled.begin(), s.light_sampled.end(),
                                [](uint8_t yes) { return yes; });
    s.direct.compute(progress, leave_direct);
    if (leave_direct) awaited_direct_ = std::make_unique<Awaited>(s.samples.size());
    frame.end_stage("direct", watch);
    if (s.holds_all()) look_around(progress, true, {}, [&] { frame.end_stage("guides", watch); });
    frame.end_stage("gather", watch);
    s.discs.refresh_areas(nullptr);
    return frame;
  });
}

Frame Session::recompute(Progress& progress) {
  check_looked();
  auto fresh = unbaked();
  fresh->take_choices(*state_);
  return replace(std::move(fresh), [&] {
    State& s = *state_;
    for (trace::Light& light : s.lights) trace::place_light(s.scene, light);
    Frame frame;
    progress.begin("index triangles", 1);
    s.caster = std::make_unique<trace::RayCaster>(s.scene, progress);
    make_cells(progress);
    trace_all(progress, frame);
    Stopwatch watch;
    s.direct.compute(progress);
    frame.end_stage("direct", watch);
    look_around(progress);
    frame.end_stage("gather", watch);
    s.discs.refresh_areas(nullptr);
    return frame;
  });
}

void Session::check_whole() const {
  DELTALUX_ASSERT(step_ == Step::rest);
  if (damaged_)
    throw Error(
        "session: memory ran out in the middle of an update, and again when everything was "
        "to be computed anew; free memory, then call update() or recompute()");
}

size_t Session::bytes() const {
  const DiscLayer& discs = state_->discs;
  return needed_bytes() + (discs.spare ? discs.spare->bytes() : 0);
}

size_t Session::needed_bytes() const {
  const State& s = *state_;
  size_t sum = s.paths.bytes() + s.discs.bytes() + s.direct.bytes();
  if (kept_) sum += kept_->bytes();
  if (looking_) sum += looking_->looks.bytes();
  if (told_) sum += (told_->discs.capacity() + told_->cells.capacity()) * sizeof(int64_t);
  if (s.gather)
    sum += s.gather->cells.bytes() + s.gather->looks.bytes() + s.gather->coverage.bytes() +
           s.gather->beams.bytes() + s.gather->sums.bytes() + s.gather->light.bytes() +
           s.gather->glance.bytes() + s.guiding.bytes();
  return sum;
}

double Session::pending_share() const {
  const double looks = state_->gather ? state_->gather->looks.pending_share() : 0.0;
  return std::max({state_->direct.pending_share(), looks, state_->paths.pending_share()});
}

}  // namespace deltalux::session
