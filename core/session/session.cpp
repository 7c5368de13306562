// SPDX-License-Identifier: Apache-2.0
// The state is replaced as a whole by bakes, and changed by edits; everything else reads it.
#include "session/session.h"

#include <cmath>
#include <string>
#include <utility>

#include "base/error.h"
#include "session/bake/bake.h"
#include "session/file/snapshot.h"
#include "session/read/digest.h"
#include "session/read/gradient.h"
#include "session/read/read_light.h"
#include "session/read/unreached.h"
#include "session/update/check_edit.h"
#include "session/update/update.h"

namespace deltalux::session {

Session::Session(scene::Scene scene, samples::SampleSet samples, const Options& options)
    : state_(std::make_unique<State>(std::move(scene), std::move(samples), options)) {}

Session::~Session() = default;

std::unique_ptr<State> Session::unbaked() const {
  auto fresh = std::make_unique<State>(state_->options);
  fresh->take_given(*state_);
  return fresh;
}

void Session::dispose(std::unique_ptr<State> waste) {
  try {
    disposal_ = std::async(std::launch::async, [gone = std::move(waste)] {});
  } catch (...) {  // no thread available: `waste` is freed on return
  }
}

void Session::forget_bake() { dispose(std::exchange(state_, unbaked())); }

Frame Session::replace(std::unique_ptr<State> fresh, const std::function<Frame(State&)>& compute) {
  try {
    Frame frame = compute(*fresh);
    fresh->baked = true;
    state_ = std::move(fresh);
    return frame;
  } catch (...) {
    dispose(std::move(fresh));
    throw;
  }
}

Frame Session::bake(Progress& progress, bool leave_direct) {
  return replace(unbaked(), [&](State& s) { return session::bake(s, progress, leave_direct); });
}

Frame Session::recompute(Progress& progress) {
  check_gathered(*state_);
  auto fresh = unbaked();
  fresh->take_choices(*state_);
  return replace(std::move(fresh), [&](State& s) { return session::recompute(s, progress); });
}

Frame Session::update(std::span<const scene::Edit> edits, double budget_ms, Progress& progress) {
  edits_applied_ = false;
  check_gathered(*state_);
  if (state_->damaged) rebuild(*state_, progress);
  // Beyond half of the limit, the light needs the memory.
  const size_t limit = state_->options.memory_limit;
  if (limit && bytes() > limit / 2) state_->discs.spare.reset();
  for (size_t i = 0; i < edits.size(); ++i) check(edits[i], edits.first(i));
  const bool complete = state_->has_all_sums();
  Update update(*state_, edits, budget_ms, progress);
  update.apply([&] { return recompute(progress); });
  edits_applied_ = true;
  if (!baked()) return {};
  state_->count_edits(edits.size(), complete);
  if (update.renewed()) return update.end();
  size_t refused = 0;
  try {
    refused = update.follow();
  } catch (...) {
    // Memory ran out in the middle of the update. Only a recomputation gives a valid state again.
    rebuild(*state_, progress);
  }
  Frame frame = update.end();
  if (refused)
    throw OptionError("memory: with longer paths the session needs more than its limit of " +
                      mebibytes(double(limit)) + "; " + std::to_string(refused) +
                      " paths wait as they were. Take the edit back, or raise the memory limit");
  if (pending_share() > 0 && progress.cancelled()) throw Cancelled();
  return frame;
}

void Session::check(const scene::Edit& edit, std::span<const scene::Edit> before) const {
  session::check(*state_, edit, before);
}

const std::vector<plan::PartPlan>& Session::plan(Progress& progress) {
  return plan_parts(*state_, progress);
}

void Session::set_planning(const plan::Machine& machine, plan::Policy policy,
                           std::optional<double> frames, bool rebuilds) {
  Options& options = state_->options;
  options.machine = machine;
  options.policy = policy;
  options.expected_frames = frames.value_or(kExpectedFrames);
  options.rebuilds = rebuilds;
}

double Session::read(double* irradiance, double* standard_error) const {
  return session::read(*state_, irradiance, standard_error);
}

void Session::read_irradiance(double* irradiance) const {
  session::read_irradiance(*state_, irradiance);
}

void Session::read_direct(double* irradiance) const { session::read_direct(*state_, irradiance); }

void Session::read_packed(const std::array<double, 3>& weights, bool errors, float* values) const {
  session::read_packed(*state_, weights, errors, values);
}

void Session::glance(float* values) { session::glance(*state_, values); }

void Session::gather_at(std::span<const Vec3f> points, std::span<const Vec3f> normals,
                        const Asked& asked, double* direct, double* indirect, double* noise,
                        Progress& progress) {
  check_readable(*state_);
  if (!state_->gathers()) throw OptionError("at: this session does not gather");
  state_->images.gather_at(points, normals, asked, direct, indirect, noise, progress);
}

void Session::read_gradient(double* gradient, Progress& progress, const SlopeSums& others) {
  session::read_gradient(*state_, gradient, progress, others);
}

SlopeSums Session::slope_sums(Progress& progress) { return session::slope_sums(*state_, progress); }

void Session::read_sums(int64_t* sums) const { session::read_sums(*state_, sums); }

std::vector<uint8_t> Session::visible(std::span<const Vec3f> from,
                                      std::span<const Vec3f> to) const {
  std::vector<uint8_t> out(from.size());
  const trace::RayCaster& caster = *state_->caster;
  state_->workers.for_blocks(out.size(), 1024, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Vec3f way = to[i] - from[i];
      out[i] = !caster.occluded(from[i], way, 1.0f);
    }
  });
  return out;
}

std::vector<float> Session::areas() {
  State& s = *state_;
  if (!s.baked || s.counts_in_discs()) return s.as_given(s.discs.area);
  Progress part;
  const DiscsInPlace discs(s, s.discs, part);
  s.discs.find_areas(nullptr);
  return s.as_given(std::exchange(s.discs.area, {}));
}

std::vector<float> Session::radii(Progress& progress) {
  const std::vector<float>& own = state_->samples.radius;
  if (baked() && std::any_of(own.begin(), own.end(), [](float r) { return std::isnan(r); }))
    state_->resolve_radii(progress);
  return state_->as_given(state_->samples.radius);
}

size_t Session::unreached() const { return count_unreached(*state_); }

std::array<uint64_t, 4> Session::digest(const std::optional<SegmentsHash>& others) const {
  return session::digest(*state_, others);
}

SegmentsHash Session::segments_hash() const {
  check_whole(*state_);
  return state_->paths.hash();
}

EnergyAudit Session::audit() const { return session::audit(*state_); }

ArchiveView Session::save(bool shared) const { return session::save(*state_, shared); }

ArchiveView Session::save_choices() const { return session::save_choices(*state_); }

void Session::restore(ArchiveSource& archive, Progress& progress) {
  session::restore(*state_, archive, progress);
}

}  // namespace deltalux::session
