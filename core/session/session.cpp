// SPDX-License-Identifier: Apache-2.0
// Bake and recompute: computes all sums of a scene from scratch.
#include "session/session.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>
#include <utility>

#include "base/assertion.h"
#include "base/cpu.h"
#include "base/curve_order.h"
#include "base/error.h"
#include "session/pilot_paths.h"
#include "session/session_parts.h"

namespace deltalux::session {
namespace {

constexpr uint64_t kSlotsPerStep = 65536;  // slots allocated between two checks for cancellation
// Where objects touch, even less of a disc may be uncovered, and a single crossing would outshine
// the scene. With this least share, such samples (some per cent of the vertices of a furnished
// room) become darker.
constexpr float kMinShare = 0.01f;

void check_samples(const scene::Scene& scene, samples::SampleSet& samples) {
  const size_t n = samples.size();
  if (samples.normal.size() != n || samples.radius.size() != n || samples.attached.size() != n)
    throw OptionError("samples: points, normals, radius and attached differ in length");
  for (size_t i = 0; i < n; ++i) {
    const std::string where = "sample " + std::to_string(i) + ": ";
    const Vec3f p = samples.point[i];
    const float l = length(samples.normal[i]);
    const float far = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
    if (!std::isfinite(p.x + p.y + p.z) || far > kFarthest)
      throw OptionError(where + "point: found a coordinate that is not finite or beyond 1e15 m");
    if (!(l > 0) || !std::isfinite(l))
      throw OptionError(where + "normal is zero or not finite, expected a direction");
    samples.normal[i] = normalize(samples.normal[i]);
    const float r = samples.radius[i];
    if (!std::isnan(r) && !(r > 0 && r <= kFarthest))
      throw OptionError(where + "radius: found " + std::to_string(r) +
                        ", expected positive metres up to 1e15");
    const uint32_t object = samples.attached[i];
    if (object != scene::kNone &&
        (object >= scene.objects.size() || !scene.objects[object].movable))
      throw OptionError(where + "attached to something that is not movable");
  }
}

/// Extends the scene's world box to hold all samples: they may lie outside of all geometry, where
/// light that leaves the scene passes.
void reach_samples(State& s) {
  // Automatic radii are hardly larger than this.
  const float radius = 0.02f * s.scene.first_world().diagonal();
  s.sample_bounds.assign(s.scene.objects.size(), {});
  const auto disc = [&](size_t i) {
    const float own = std::isnan(s.samples.radius[i]) ? radius : s.samples.radius[i];
    return Box{s.samples.point[i], s.samples.point[i]}.padded(own);
  };
  for (size_t i = 0; i < s.samples.size(); ++i) {
    const uint32_t object = s.samples.attached[i];
    const Vec3f p = s.samples.point[i];
    if (object != scene::kNone)
      s.sample_bounds[object].grow(p);
    else if (!s.scene.first_world().contains(Box{p, p}))
      s.scene.extend_world(disc(i));
  }
  for (uint32_t i = 0; i < s.scene.objects.size(); ++i) {
    const Box own = s.bounds_at(i, s.scene.objects[i].pose);
    if (s.scene.objects[i].movable && !s.scene.first_world().contains(own))
      s.scene.extend_world(own);
  }
}

/// Orders samples along a Hilbert curve, and samples at the same point by their normals, so that
/// the order in which they were given does not matter.
std::vector<uint32_t> places_in_order(const samples::SampleSet& samples) {
  std::vector<uint64_t> ties(samples.size());
  for (size_t i = 0; i < ties.size(); ++i)
    ties[i] = direct::place_key(samples.point[i], samples.normal[i]);
  return curve_order(samples.point, Curve::hilbert, nullptr, ties);
}

}  // namespace

Session::Session(scene::Scene scene, samples::SampleSet samples, const Options& options)
    : state_(std::make_unique<State>(options)) {
  isa();  // refuses a wrong DELTALUX_ISA before any work
  if (options.paths < 1) throw OptionError("paths: found 0, expected at least 1");
  if (options.paths > 0xfffffff0u) throw OptionError("paths: expected at most 4e9");
  if (options.range &&
      (options.range->first > options.range->last || options.range->last > options.paths))
    throw OptionError("path_range: found (" + std::to_string(options.range->first) + ", " +
                      std::to_string(options.range->last) +
                      "), expected (first, last) with 0 <= first <= last <= " +
                      std::to_string(options.paths) + ", the number of paths");
  if (options.max_bounces < 1 || options.max_bounces > 10'000)
    throw OptionError("max_bounces: expected 1 to 10000");
  scene.finish();
  check_samples(scene, samples);
  state_->scene = std::move(scene);
  state_->given = places_in_order(samples);
  state_->samples = samples.reordered(state_->given);
  reach_samples(*state_);
  state_->group_factor.assign(state_->scene.group_count, 1.0);
  state_->lights = trace::find_lights(state_->scene);
  trace::allot_paths(state_->lights, trace::shares_by_power(state_->lights), options.paths,
                     kBatches);
  state_->scale = trace::choose_scale(state_->lights, options.max_bounces);
  state_->group_sums();
  for (const scene::Material& material : state_->scene.materials)
    state_->loaded_reflectance.push_back(material.reflectance);
}

Session::~Session() = default;

void Session::trace_all(Progress& progress, Frame& frame) {
  State& s = *state_;
  s.hold_paths();
  const uint64_t paths = s.held.size();
  s.added.clear();
  s.added_since.reset();
  told_.reset();
  s.store = segments::SegmentStore(s.scene.world(), s.extras());
  s.cut.assign(paths, kNotCut);
  s.sums.assign(s.sum_count(), 0);
  s.sum_marks.clear();
  pending_.clear();
  for (MovingPart& part : s.moving) {
    place_part(s, part);
    part.current = true;
  }
  progress.begin("trace paths", paths);
  const PathCounts counts = trace_lights(progress);
  DELTALUX_ASSERT(std::all_of(s.sums.begin(), s.sums.end(), [](int64_t sum) { return sum >= 0; }));
  frame.retraced_segments = counts.retraced;
  frame.affected_paths = paths;
  frame.milliseconds.emplace_back("trace", counts.trace_ms);
  frame.milliseconds.emplace_back("deposit", counts.deposit_ms);
}

PathCounts Session::trace_lights(Progress& progress) {
  State& s = *state_;
  const uint64_t total = s.cut.size();
  std::vector<uint32_t> slots;
  for (uint64_t done = 0; done < total; done += slots.size()) {
    progress.check();
    s.store.bounce(0).allocate(std::min(total - done, kSlotsPerStep), s.store.extras(), slots);
  }
  PathUpdate update(s);
  const uint64_t steps = (total + kPathsPerStep - 1) / kPathsPerStep;
  for (uint64_t step = 0; step < steps; ++step) {
    slots.clear();
    for (const trace::Light& light : s.lights) {
      // Each batch contributes the same share to every step.
      for (uint32_t batch = 0; batch < kBatches; ++batch) {
        const auto [from, end] = s.held.of_batch(light, batch);
        const uint64_t count = end - from;
        const uint64_t first = count * step / steps, last = count * (step + 1) / steps;
        if (first == last) continue;
        const uint32_t slot = s.held.slot_of(uint32_t(light.first_path + from));
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
  fresh->scene = state_->scene;
  fresh->samples = state_->samples;
  fresh->given = state_->given;
  fresh->sample_bounds = state_->sample_bounds;
  fresh->lights = state_->lights;
  fresh->group_factor = state_->group_factor;
  fresh->scale = state_->scale;
  fresh->sum_groups = state_->sum_groups;
  fresh->loaded_reflectance = state_->loaded_reflectance;
  return fresh;
}

void Session::forget_bake() {
  std::unique_ptr<State> old = std::exchange(state_, unbaked());
  direct_.reset(), kept_.reset(), told_.reset(), looking_.reset(), spare_discs_.reset();
  awaited_direct_.reset();
  pending_.clear();
  baked_ = damaged_ = false;
  dispose(std::move(old));
}

Frame Session::bake(Progress& progress, bool leave_direct) {
  // Works on a copy of what the user gave, so that a cancelled bake leaves the session unchanged.
  auto fresh = unbaked();
  std::swap(state_, fresh);
  auto old_direct = std::move(direct_);
  auto old_pending = std::exchange(pending_, {});
  auto old_told = std::move(told_);
  auto old_looking = std::move(looking_);
  auto old_awaited = std::move(awaited_direct_);
  try {
    Frame frame;
    Stopwatch watch;
    index_triangles(progress);
    make_cells(progress);
    allot_paths(progress);
    const PilotPaths paths = walk_pilot_paths(*state_, progress);
    forecast_memory(paths);
    choose_direct();
    refuse_beyond_limit();
    Parts parts;
    if (state_->counts_in_discs()) parts = place_parts(progress);
    take_places(parts);
    frame.end_stage("prepare", watch);
    plan_parts(parts, paths, false, progress);
    make_estimators(parts, progress);
    frame.end_stage("plan", watch);
    trace_all(progress, frame);
    watch.lap();
    leave_direct &= state_->holds_none() && !state_->samples.point.empty() &&
                    std::any_of(state_->light_sampled.begin(), state_->light_sampled.end(),
                                [](uint8_t yes) { return yes; });
    compute_direct(progress, leave_direct);
    if (leave_direct) awaited_direct_ = std::make_unique<Awaited>(state_->samples.size());
    frame.end_stage("direct", watch);
    if (state_->holds_all())
      look_around(progress, true, {}, [&] { frame.end_stage("guides", watch); });
    frame.end_stage("gather", watch);
    refresh_areas(nullptr);
    spare_discs_.reset();
    baked_ = true;
    damaged_ = false;
    return frame;
  } catch (...) {
    std::swap(state_, fresh);
    direct_ = std::move(old_direct);
    pending_ = std::move(old_pending);
    told_ = std::move(old_told);
    looking_ = std::move(old_looking);
    awaited_direct_ = std::move(old_awaited);
    dispose(std::move(fresh));
    throw;
  }
}

Frame Session::recompute(Progress& progress) {
  check_looked();
  State& s = *state_;
  std::vector<trace::Light> lights = s.lights;
  for (trace::Light& light : lights) trace::place_light(s.scene, light);
  // The parts that a cancelled recompute must restore.
  std::swap(s.lights, lights);
  auto old_caster = std::move(s.caster);
  auto old_store = std::move(s.store);
  auto old_sums = std::move(s.sums);
  auto old_marks = std::move(s.sum_marks);
  auto old_cut = std::move(s.cut);
  auto old_added = std::pair(s.added, s.added_since);
  auto old_told = std::move(told_);
  auto old_pending = std::move(pending_);
  auto old_direct = std::move(direct_);
  auto old_gather = std::move(s.gather);
  try {
    Frame frame;
    progress.begin("index triangles", 1);
    s.caster = std::make_unique<trace::RayCaster>(s.scene, progress);
    make_cells(progress);
    trace_all(progress, frame);
    Stopwatch watch;
    compute_direct(progress);
    frame.end_stage("direct", watch);
    look_around(progress);
    frame.end_stage("gather", watch);
    refresh_areas(nullptr);
    damaged_ = false;
    return frame;
  } catch (...) {
    std::swap(s.lights, lights);
    s.caster = std::move(old_caster);
    std::swap(s.store, old_store);
    dispose(std::move(old_store));
    s.sums = std::move(old_sums);
    s.sum_marks = std::move(old_marks);
    s.cut = std::move(old_cut);
    std::tie(s.added, s.added_since) = std::move(old_added);
    told_ = std::move(old_told);
    pending_ = std::move(old_pending);
    direct_ = std::move(old_direct);
    s.gather = std::move(old_gather);
    throw;
  }
}

void Session::refresh_areas(const std::vector<ObjectChange>* changes) {
  if (!state_->counts_in_discs()) return;
  if (state_->evaluates())
    find_areas(changes);
  else
    state_->area.assign(state_->samples.size(), 0.0f);
}

void Session::find_areas(const std::vector<ObjectChange>* changes) {
  State& s = *state_;
  std::vector<float> area = s.area;
  area.resize(s.samples.size(), 1.0f);
  const bool whole = s.options.disc_area == samples::DiscArea::whole;
  const auto refresh = [&](const samples::DiscSet& discs, const MovingPart* part) {
    const Pose pose = part ? s.scene.objects[part->object].pose : Pose{};
    samples::ForeignGeometry foreign{s.caster.get(), part != nullptr,
                                     part ? part->object : scene::kNone};
    const bool part_moved = part && changes &&
                            std::any_of(changes->begin(), changes->end(),
                                        [&](const auto& c) { return c.object == part->object; });
    s.workers.for_blocks(discs.size(), 512, [&](size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const Vec3f centre = part ? pose.point(discs.centre[i]) : discs.centre[i];
        bool touched = !changes || part_moved;
        for (size_t k = 0; changes && !touched && k < changes->size(); ++k)
          touched = (*changes)[k].before.touches_sphere(centre, discs.radius[i]) ||
                    (*changes)[k].after.touches_sphere(centre, discs.radius[i]);
        if (!touched) continue;
        bool reached = part != nullptr;
        for (uint32_t object : s.caster->present())
          reached =
              reached || s.caster->object_bounds(object).touches_sphere(centre, discs.radius[i]);
        const float counted = reached && !whole ? samples::uncovered_area(discs, i, pose, foreign)
                                                : samples::outline_area(discs, i);
        const float circle = std::numbers::pi_v<float> * discs.radius[i] * discs.radius[i];
        const float openness = s.openness[discs.id[i]];
        area[discs.id[i]] =
            counted > 0 && openness > 0 ? std::max(counted, kMinShare * circle) / openness : 0.0f;
      }
    });
  };
  refresh(s.static_index->discs(), nullptr);
  for (const MovingPart& part : s.moving) refresh(part.index->discs(), &part);
  s.area = std::move(area);
}

void Session::check_whole() const {
  DELTALUX_ASSERT(step_ == Step::rest);
  if (damaged_)
    throw Error(
        "session: memory ran out in the middle of an update, and again when everything was "
        "to be computed anew; free memory, then call update() or recompute()");
}

size_t Session::bytes() const {
  size_t sum = needed_bytes();
  if (spare_discs_) {
    sum += spare_discs_->still->bytes() + spare_discs_->openness.capacity() * sizeof(float);
    for (const MovingPart& part : spare_discs_->moving) sum += part.index->bytes();
  }
  return sum;
}

size_t Session::needed_bytes() const {
  const State& s = *state_;
  size_t sum = s.store.bytes() + s.cut.capacity() + s.sums.capacity() * sizeof(int64_t) +
               s.sum_marks.capacity() + pending_.capacity() * sizeof(PendingPath) +
               receivers_.capacity() * sizeof(direct::Receiver);
  if (direct_) sum += direct_->bytes();
  if (kept_) sum += kept_->bytes();
  if (looking_) sum += looking_->looks.bytes();
  if (told_) sum += (told_->discs.capacity() + told_->cells.capacity()) * sizeof(int64_t);
  if (s.gather)
    sum += s.gather->cells.bytes() + s.gather->looks.bytes() + s.gather->coverage.bytes() +
           s.gather->beams.bytes() + s.gather->sums.bytes() + s.gather->light.bytes() +
           s.gather->glance.bytes() + s.guiding.bytes();
  if (s.static_index) sum += s.static_index->bytes();
  for (const MovingPart& part : s.moving) sum += part.index->bytes();
  return sum;
}

double Session::pending_share() const {
  const size_t paths = state_->cut.size();
  const double lights = direct_ ? 1 - direct_->current_share() : 0.0;
  const double looks = state_->gather ? state_->gather->looks.pending_share() : 0.0;
  return std::max({lights, looks, paths ? double(pending_.size()) / double(paths) : 0.0});
}

}  // namespace deltalux::session
