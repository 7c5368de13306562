// SPDX-License-Identifier: Apache-2.0
// Edits: validation, the search for what they affect, and the replacement of affected paths.
#include <algorithm>
#include <numbers>
#include <utility>

#include "base/assertion.h"
#include "base/error.h"
#include "session/flow/edit_log.h"
#include "session/flow/reach.h"
#include "session/paths/pending.h"
#include "session/paths/pilot_paths.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

constexpr double kDirectShare = 0.4;  // of a time budget: at most this share goes to shadow rays
// The first step of an update with a time budget: measures how fast paths are replaced.
constexpr size_t kFirstStep = 128;

/// The object that an edit refers to: one of the scene, or one inserted by the edits `before` it.
const scene::Object& movable_object(const scene::Scene& scene, std::span<const scene::Edit> before,
                                    uint32_t index) {
  if (index < scene.objects.size()) {
    const scene::Object& object = scene.objects[index];
    if (!object.movable)
      throw OptionError("\"" + object.name + "\" is static; list it in `movable` to edit it");
    return object;
  }
  size_t number = index - scene.objects.size();
  for (const scene::Edit& edit : before)
    if (const auto* insert = std::get_if<scene::Insert>(&edit); insert && number-- == 0)
      return insert->object;
  throw OptionError("edit: no such object");
}

void check_place(const State& s, const scene::Object& object, const Box& bounds) {
  const std::string refusal = Reach(s).refusal(bounds);
  if (!refusal.empty()) throw OptionError("\"" + object.name + "\" " + refusal);
}

/// Number of light groups after these edits.
uint32_t groups_after(const scene::Scene& scene, std::span<const scene::Edit> edits) {
  uint32_t groups = scene.group_count;
  for (const scene::Edit& edit : edits)
    if (const auto* insert = std::get_if<scene::Insert>(&edit))
      groups = scene::groups_with(insert->object, groups);
  return groups;
}

/// The dim factor of a group after these edits.
double factor_after(const State& s, uint32_t group, std::span<const scene::Edit> edits) {
  double factor = group < s.group_factor.size() ? s.group_factor[group] : 1.0;
  for (const scene::Edit& edit : edits)
    if (const auto* dim = std::get_if<scene::Dim>(&edit); dim && dim->group == group)
      factor = dim->factor;
  return factor;
}

/// The lights of inserted objects.
struct AddedLights {
  std::vector<trace::Light> lights;
  uint64_t paths = 0;
};

AddedLights lights_of_inserts(const State& s, std::span<const scene::Edit> before,
                              const scene::Object& object) {
  AddedLights added;
  uint32_t groups = s.scene.group_count;
  const auto add = [&](const scene::Object& own) {
    groups = scene::groups_with(own, groups);
    scene::Scene alone;
    alone.materials = s.scene.materials;
    alone.group_count = groups;
    alone.objects.push_back(own);
    alone.finish();
    for (const trace::Light& light : added_lights(s, alone, 0, groups)) {
      added.lights.push_back(light);
      added.paths += light.path_count;
    }
  };
  for (const scene::Edit& edit : before)
    if (const auto* insert = std::get_if<scene::Insert>(&edit)) add(insert->object);
  add(object);
  return added;
}

/// Bytes of the sums that a session needs in addition for so many light groups in all, and for the
/// paths of these new lights.
double bytes_of_groups(const State& s, uint32_t groups, std::vector<trace::Light> added) {
  const double fresh = double(groups - s.scene.group_count);
  std::vector<SumGroup> all = s.sum_groups;
  assign_sums(added, all);
  const double sums = double(all.size() - s.sum_groups.size()) * kBatches;
  const double discs = s.counts_in_discs() ? double(s.samples.size()) : 0.0;
  const double cells = s.gather ? double(s.gather->cells.size()) : 0.0;
  const double receivers = s.evaluates() ? double(s.samples.size()) : 0.0;
  return 3 * sizeof(int64_t) * (sums * (discs + cells) + fresh * receivers);
}

constexpr double kMostShared = 1.5;  // dim factor that integer sums of several groups have room for
constexpr const char* kNoRoom =
    "more than eight groups share sums, and these have no room for a factor above 1.5";

std::string mebibytes(double bytes) { return std::to_string(uint64_t(bytes) >> 20) + " MiB"; }

/// Whether no cell's sum is negative, since only what was added is removed. (Sums of discs may come
/// from a file, and all sums of a session without paths from the user.)
bool cells_are_possible(const State& s) {
  return !s.gather || s.holds_none() ||
         std::all_of(s.gather->sums.quanta.begin(), s.gather->sums.quanta.end(),
                     [](int64_t sum) { return sum >= 0; });
}

/// Whether an edit (dimming, a new reflectance) may change the light of any sample.
bool shows_everywhere(std::span<const scene::Edit> edits) {
  return std::any_of(edits.begin(), edits.end(), [](const scene::Edit& edit) {
    return std::holds_alternative<scene::Dim>(edit) ||
           std::holds_alternative<scene::SetReflectance>(edit);
  });
}

}  // namespace

void Session::check_insert(const scene::Object& object, std::span<const scene::Edit> before) const {
  const State& s = *state_;
  if (!baked_) throw OptionError("add: bake the session before adding a new mesh");
  const std::string what = "add \"" + object.name + "\": ";
  const uint32_t known = groups_after(s.scene, before);
  const uint32_t groups = scene::groups_with(object, known);
  s.scene.check(object, groups);
  check_place(s, object, bounds_at(object, object.pose));
  constexpr uint32_t kLast = kMaxOwnGroups - 1;
  if (World::merged(kLast, groups) && !World::merged(kLast, known) &&
      factor_after(s, kLast, before) > kMostShared)
    throw OptionError(what + "with its light group, " + kNoRoom +
                      "; give it one of the session's groups, or dim the eighth one first");
  const bool sampled = s.samples_added_lights();
  AddedLights added = lights_of_inserts(s, before, object);
  const uint64_t more = added.paths;
  if (!more && groups == s.scene.group_count) return;
  const uint64_t paths = s.all_paths(), most = s.scale.most_paths(s.options.max_bounces);
  if (more > most - std::min(most, paths))
    throw OptionError(what + "its light needs " + std::to_string(more) + " paths beside the " +
                      std::to_string(paths) + " of the session, expected at most " +
                      std::to_string(most) +
                      " in all so that no integer sum can overflow; "
                      "start a new session with it in the scene");
  const double per_path =
      paths ? double(s.paths.store.bytes()) / double(paths) : 4.0 * sizeof(segments::Segment);
  const double needed =
      double(needed_bytes()) + per_path * double(more) + bytes_of_groups(s, groups, added.lights) +
      double(direct::DirectLight::forecast_bytes(
          s.samples.size(), 0, added.lights, std::vector<uint8_t>(added.lights.size(), sampled)));
  if (s.options.memory_limit && needed > double(s.options.memory_limit))
    throw OptionError(what + "memory: with the paths of its light the session would need about " +
                      mebibytes(needed) + ", the limit is " +
                      mebibytes(double(s.options.memory_limit)) +
                      "; raise the memory limit, or start a new session with it in the scene");
}

void Session::check(const scene::Edit& edit, std::span<const scene::Edit> before) const {
  const scene::Scene& scene = state_->scene;
  if (const auto* move = std::get_if<scene::Move>(&edit)) {
    const scene::Object& object = movable_object(scene, before, move->object);
    check_place(*state_, object,
                move->object < scene.objects.size() ? state_->bounds_at(move->object, move->pose)
                                                    : bounds_at(object, move->pose));
  } else if (const auto* presence = std::get_if<scene::SetPresent>(&edit)) {
    movable_object(scene, before, presence->object);
  } else if (const auto* insert = std::get_if<scene::Insert>(&edit)) {
    check_insert(insert->object, before);
  } else if (const auto* dim = std::get_if<scene::Dim>(&edit)) {
    const uint32_t groups = groups_after(scene, before);
    if (dim->group >= groups) throw OptionError("dim: no such group");
    if (!(dim->factor >= 0) || !(dim->factor <= 1e6))
      throw OptionError("dim: found factor " + std::to_string(dim->factor) +
                        ", expected 0 to 1e6 (1 = as loaded)");
    if (World::merged(dim->group, groups) && dim->factor > kMostShared)
      throw OptionError(std::string("dim: ") + kNoRoom);
  } else if (const auto* paint = std::get_if<scene::SetReflectance>(&edit)) {
    if (paint->material >= scene.materials.size())
      throw OptionError("reflectance: no such material");
    for (int c = 0; c < 3; ++c)
      if (!(paint->reflectance[c] >= 0 && paint->reflectance[c] <= 1))
        throw OptionError("reflectance: expected 0 to 1 per channel");
    const scene::Material& material = scene.materials[paint->material];
    if (!material.admits(paint->reflectance))
      throw OptionError("reflectance: the surface of material \"" + material.name +
                        "\" would reflect more than it receives where it is brightest; expected "
                        "a lower mean");
  }
}

Frame Session::update(std::span<const scene::Edit> edits, double budget_ms, Progress& progress) {
  edits_applied_ = false;
  check_looked();
  if (damaged_) rebuild(progress);
  // Beyond half of the limit, the light needs the memory.
  if (const size_t limit = state_->options.memory_limit; limit && bytes() > limit / 2)
    state_->discs.spare.reset();
  DELTALUX_ASSERT(step_ == Step::rest && agree(state_->paths));
  for (size_t i = 0; i < edits.size(); ++i) check(edits[i], edits.first(i));
  Frame frame;
  Stopwatch watch;
  EditLog log(*state_);
  const bool complete = has_all_sums();
  const Affected affected = apply(edits, log, budget_ms, watch, progress, frame);
  edits_applied_ = true;
  if (!baked_) return frame;
  count_edits(edits.size(), complete);
  enter(Step::rest, Step::applied);
  if (log.changes_world()) {
    enter(Step::applied, Step::rest);
    frame.milliseconds.emplace_back("total", watch.milliseconds());
    return frame;
  }
  frame.scanned_segments = affected.scanned;
  frame.candidates = affected.candidates;
  size_t refused = 0;
  try {
    refused = follow(edits, log, affected, budget_ms, watch, progress, frame);
  } catch (...) {
    // Memory ran out in the middle of the update. Only a recomputation gives a valid state again.
    rebuild(progress);
  }
  frame.milliseconds.emplace_back("total", watch.milliseconds());
  if (refused)
    throw OptionError("memory: with longer paths the session needs more than its limit of " +
                      mebibytes(double(state_->options.memory_limit)) + "; " +
                      std::to_string(refused) +
                      " paths wait as they were. Take the edit back, or raise the memory limit");
  if (state_->gather) frame.done = std::min(frame.done, 1 - state_->gather->looks.pending_share());
  if (pending_share() > 0 && progress.cancelled()) throw Cancelled();
  return frame;
}

Affected Session::apply(std::span<const scene::Edit> edits, EditLog& log, double budget_ms,
                        Stopwatch& watch, Progress& progress, Frame& frame) {
  State& s = *state_;
  Affected affected;
  try {
    log.apply(edits);
    if (!baked_) return affected;
    grow_sums(progress);
    frame.end_stage("geometry", watch);
    if (log.reflects_more()) refuse_growth(progress);
    if (log.changes_world()) {
      renew(progress, frame);
      return affected;
    }
    s.discs.place_parts();
    if (!log.changes().empty() || !log.materials().empty())
      affected = find_affected(s, log.changes(), log.materials(), progress);
    frame.end_stage("scan", watch);
    // The last step that can fail; if it does, it undoes its own changes.
    s.direct.update(log.change(), log.changes(), log.old_lights(), kDirectShare * budget_ms,
                    progress);
  } catch (...) {
    log.undo();
    if (baked_) {
      shrink_sums();
      s.discs.place_parts();
      s.direct.place();
    }
    throw;
  }
  return affected;
}

void Session::renew(Progress& progress, Frame& frame) {
  Frame again = recompute(progress);
  again.milliseconds.insert(again.milliseconds.begin(), frame.milliseconds.begin(),
                            frame.milliseconds.end());
  frame = std::move(again);
}

size_t Session::follow(std::span<const scene::Edit> edits, const EditLog& log,
                       const Affected& affected, double budget_ms, Stopwatch& watch,
                       Progress& progress, Frame& frame) {
  State& s = *state_;
  frame.end_stage("direct", watch);
  const double left = budget_ms > 0 ? budget_ms - watch.milliseconds() : budget_ms;
  const size_t refused = replace_paths(log, affected, left, progress, frame);
  watch.lap();
  note_looks(log);
  if (s.gather && shows_everywhere(edits)) s.gather->glance.stale = true;
  if (s.gather && s.evaluates()) {
    const gather::Looks::Cast cast = s.gather->looks.follow(
        present(s.direct.receivers, s.guiding), s.workers, progress,
        [&](size_t i) { renew_share(i); },
        [&] {
          return !progress.cancelled() && (budget_ms == 0 || watch.milliseconds() < budget_ms);
        });
    frame.gathered_rays = cast.rays, frame.changed_rays = cast.changed;
  }
  frame.end_stage("gather", watch);
  if (!log.changes().empty()) s.discs.refresh_areas(&log.changes());
  frame.end_stage("areas", watch);
  DELTALUX_ASSERT(cells_are_possible(s) && frame.done >= 0 && frame.done <= 1);
  enter(Step::replaced, Step::rest);
  return refused;
}

void Session::rebuild(Progress& progress) {
  damaged_ = true;
  step_ = Step::rest;  // wherever the update failed
  Frame frame;
  Progress unstoppable;
  state_->paths.pending.clear();
  progress.announce("compute again", 1);
  make_cells(unstoppable);
  trace_all(unstoppable, frame);
  state_->direct.compute(unstoppable);
  look_around(unstoppable);
  state_->discs.refresh_areas(nullptr);
  damaged_ = false;
}

size_t Session::replace_paths(const EditLog& log, const Affected& affected, double budget_ms,
                              Progress& progress, Frame& frame) {
  State& s = *state_;
  const std::vector<ObjectChange>& changes = log.changes();
  // Cut each path at the earliest bounce that any edit affects.
  EditMarks marks(s.paths);
  // Begin with lights whose paths start anew: the search saw their old paths, which no longer
  // count.
  for (size_t l = 0; l < log.old_lights(); ++l)
    if (log.reborn(l)) marks.mark_all(s.lights[l]);
  for (uint32_t b = 0; b < affected.segments.size(); ++b)
    for (const AffectedSegment& segment : affected.segments[b])
      marks.mark({s.paths.store.bounce(b).at(segment.slot).path, segment.slot, uint16_t(b),
                  segment.hit_known, segment.hit});
  if (s.lights.size() > log.old_lights()) marks.add_lights(log.old_lights());
  if (budget_ms != 0) marks.order();
  enter(Step::applied, Step::marked);
  DELTALUX_ASSERT(agree(s.paths));

  // Sum the samples of moved objects anew, from the stored segments near the new pose. A session
  // without paths is given what becomes of their sums.
  std::vector<size_t> again;
  for (MovingPart& part : s.discs.moving)
    for (size_t k = 0; k < changes.size(); ++k)
      if (changes[k].object == part.object && !s.holds_none()) {
        part.current = false;
        again.push_back(k);
      }
  const auto between = [&] {
    Deposit deposit(s.paths, s.discs);
    for (size_t k : again)
      for (MovingPart& part : s.discs.moving) {
        if (part.object != changes[k].object) continue;
        s.discs.clear_part(part);
        part.current = true;
        if (!s.scene.objects[part.object].present) continue;
        for (uint32_t b = 0; b < affected.near[k].size(); ++b)
          deposit.add_to_part(part, b, affected.near[k][b]);
      }
    deposit.finish();
    again.clear();
  };
  return run_pending(budget_ms, progress, frame, between);
}

size_t Session::run_pending(double budget_ms, Progress& progress, Frame& frame,
                            const std::function<void()>& between) {
  const Stopwatch watch;
  State& s = *state_;
  const size_t total = s.paths.pending.size();
  size_t done = 0;
  // Only stored segments can grow here; all other memory was admitted earlier.
  const size_t held = s.paths.store.bytes(), other = needed_bytes() - held;
  const size_t most =
      std::max(held, s.options.memory_limit - std::min(other, s.options.memory_limit));
  PathUpdate update(s);
  progress.announce("replace paths", total);
  // The first step, which always runs, also adds the samples of moved objects; from then on these
  // take part in every replacement, as static samples do.
  size_t step = budget_ms != 0 ? kFirstStep : kMaxPerStep;
  bool refused = false;
  do {
    // The number of paths that fit even if all were of the greatest length, so that a breach of the
    // limit is noticed early.
    const double longest = double(s.options.max_bounces) * s.paths.bytes_per_segment();
    const double room = double(most) - double(std::min(most, s.paths.store.bytes()));
    const size_t fit = s.options.memory_limit ? size_t(room / longest) : kMaxPerStep;
    const size_t end = std::min({total, done + step, done + std::max(kFirstStep, fit)});
    const size_t removed = update.counts().removed, retraced = update.counts().retraced;
    update.replace(std::span(s.paths.pending).subspan(done, end - done), done ? nullptr : between);
    progress.advance(end - done);
    done = end;
    // Paths that become shorter again need no more memory, though the store does not shrink.
    refused = s.options.memory_limit && s.paths.store.bytes() > most && done < total &&
              update.counts().retraced - retraced > update.counts().removed - removed;
    if (refused) break;
    if (budget_ms == 0 || done == total) continue;
    const double spent = watch.milliseconds(), left = budget_ms - spent;
    if (left <= 0) break;
    const double fits = double(done) * left / spent;  // may exceed the range of integers
    step = size_t(std::clamp(fits, 1.0, double(std::min(2 * step, kMaxPerStep))));
  } while (done < total && !progress.cancelled());
  s.paths.pending.erase(s.paths.pending.begin(), s.paths.pending.begin() + long(done));
  enter(Step::marked, Step::replaced);
  DELTALUX_ASSERT(agree(s.paths));
  frame.affected_paths = update.counts().paths;
  frame.removed_segments = update.counts().removed;
  frame.retraced_segments = update.counts().retraced;
  frame.done =
      std::min(s.direct.light->current_share(), total ? double(done) / double(total) : 1.0);
  frame.milliseconds.emplace_back("remove", update.counts().remove_ms);
  frame.milliseconds.emplace_back("moving samples", update.counts().moving_ms);
  frame.milliseconds.emplace_back("trace", update.counts().trace_ms);
  frame.milliseconds.emplace_back("deposit", update.counts().deposit_ms);
  return refused ? total - done : 0;
}

void Session::refuse_growth(Progress& progress) {
  const State& s = *state_;
  const double limit = double(s.options.memory_limit), paths = double(s.paths.cut.size());
  const double other = double(needed_bytes() - s.paths.store.bytes());
  const double longest = double(s.options.max_bounces) * s.paths.bytes_per_segment();
  if (!s.options.memory_limit || other + paths * longest <= limit) return;
  const PilotPaths pilot = walk_pilot_paths(s, progress);
  const double needed =
      other + pilot.weight() * double(pilot.flights.size()) * s.paths.bytes_per_segment();
  if (needed > limit && needed > double(needed_bytes()))
    throw OptionError(
        "reflectance: memory: brighter surfaces make longer paths, which would need "
        "about " +
        mebibytes(needed) + ", the limit is " + mebibytes(limit) +
        "; set it back, raise the memory limit, or bake with fewer paths");
}

}  // namespace deltalux::session
