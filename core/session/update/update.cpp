// SPDX-License-Identifier: Apache-2.0
// An update in steps (see Step): apply, mark, replace, gather.
#include "session/update/update.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "base/assertion.h"
#include "base/error.h"
#include "session/flow/path_update.h"
#include "session/paths/pending.h"
#include "session/paths/pilot_paths.h"

namespace deltalux::session {
namespace {

constexpr double kDirectShare = 0.4;  // of a time budget: at most this share goes to shadow rays
// The first step of an update with a time budget: measures how fast paths are replaced.
constexpr size_t kFirstStep = 128;

/// Whether no cell's sum is negative. (Sums of discs may come from a file, and all sums of a
/// session without paths from the user.)
bool cells_are_possible(const State& s) { return s.holds_none() || s.cells.are_sums_possible(); }

/// Whether an edit (dimming, a new reflectance) may change the light of any sample.
bool shows_everywhere(std::span<const scene::Edit> edits) {
  return std::any_of(edits.begin(), edits.end(), [](const scene::Edit& edit) {
    return std::holds_alternative<scene::Dim>(edit) ||
           std::holds_alternative<scene::SetReflectance>(edit);
  });
}

}  // namespace

Update::Update(State& state, std::span<const scene::Edit> edits, double budget_ms,
               Progress& progress)
    : s_(state), edits_(edits), budget_ms_(budget_ms), progress_(progress), log_(state) {
  DELTALUX_ASSERT(state.step == Step::rest && agree(state.paths));
}

void Update::apply(const std::function<Frame()>& renew) {
  const bool baked = s_.baked;
  try {
    log_.apply(edits_);
    if (!baked) return;
    s_.grow_sums(progress_);
    frame_.end_stage("geometry", watch_);
    if (log_.reflects_more()) refuse_growth();
    if (log_.changes_world()) {
      Frame again = renew();
      again.milliseconds.insert(again.milliseconds.begin(), frame_.milliseconds.begin(),
                                frame_.milliseconds.end());
      frame_ = std::move(again);
      return;
    }
    s_.discs.place_parts();
    if (!log_.changes().empty() || !log_.materials().empty())
      affected_ = find_affected(s_, log_.changes(), log_.materials(), progress_);
    frame_.end_stage("scan", watch_);
    // The last step that can fail; if it does, it undoes its own changes.
    s_.direct.update(log_.change(), log_.changes(), log_.old_lights(), kDirectShare * budget_ms_,
                     progress_);
  } catch (...) {
    log_.undo();
    if (baked) {
      s_.shrink_sums();
      s_.discs.place_parts();
      s_.direct.place();
    }
    throw;
  }
  s_.enter(Step::rest, Step::applied);
  frame_.scanned_segments = affected_.scanned;
  frame_.candidates = affected_.candidates;
}

size_t Update::follow() {
  frame_.end_stage("direct", watch_);
  const double left = budget_ms_ > 0 ? budget_ms_ - watch_.milliseconds() : budget_ms_;
  const size_t refused = replace_paths(left);
  watch_.lap();
  gather_again();
  frame_.end_stage("gather", watch_);
  if (!log_.changes().empty()) s_.discs.refresh_areas(&log_.changes());
  frame_.end_stage("areas", watch_);
  DELTALUX_ASSERT(cells_are_possible(s_) && frame_.done >= 0 && frame_.done <= 1);
  s_.enter(Step::replaced, Step::rest);
  return refused;
}

void Update::gather_again() {
  if (!s_.gathers()) return;
  if (shows_everywhere(edits_)) s_.rays.glance.stale = true;
  if (!s_.evaluates()) return;
  gather::Change change{log_.change(), std::vector<uint8_t>(s_.samples.size()), {}};
  if (!change.scene.empty()) {
    for (const uint32_t id : moved_samples(s_, log_.changes())) change.samples[id] = 1;
    s_.cells.update(change.scene);
    s_.rays.note(change);
    s_.images.note(change);
  }
  const gather::GatherHits::Cast cast = s_.rays.follow(progress_, [&] {
    return !progress_.cancelled() && (budget_ms_ == 0 || watch_.milliseconds() < budget_ms_);
  });
  frame_.gathered_rays = cast.rays, frame_.changed_rays = cast.changed;
  frame_.done = std::min(frame_.done, 1 - s_.rays.pending_share());
}

Frame Update::end() {
  frame_.milliseconds.emplace_back("total", watch_.milliseconds());
  return std::move(frame_);
}

size_t Update::replace_paths(double budget_ms) {
  const std::vector<ObjectChange>& changes = log_.changes();
  // Cut each path at the earliest bounce that any edit affects.
  EditMarks marks(s_.paths);
  // Begin with lights whose paths start anew: the search saw their old paths, which no longer
  // count.
  for (size_t l = 0; l < log_.old_lights(); ++l)
    if (log_.reborn(l)) marks.mark_all(s_.lights[l]);
  for (uint32_t b = 0; b < affected_.segments.size(); ++b)
    for (const AffectedSegment& segment : affected_.segments[b])
      marks.mark({s_.paths.store.bounce(b).at(segment.slot).path, segment.slot, uint16_t(b),
                  segment.hit_known, segment.hit});
  if (s_.lights.size() > log_.old_lights()) marks.add_lights(log_.old_lights());
  if (budget_ms != 0) marks.order();
  s_.enter(Step::applied, Step::marked);
  DELTALUX_ASSERT(agree(s_.paths));

  // Sum the samples of moved objects anew, from the stored segments near the new pose. A session
  // without paths is given what becomes of their sums.
  std::vector<size_t> again;
  for (MovingPart& part : s_.discs.moving)
    for (size_t k = 0; k < changes.size(); ++k)
      if (changes[k].object == part.object && !s_.holds_none()) {
        part.current = false;
        again.push_back(k);
      }
  const auto between = [&] {
    Deposit deposit(s_.paths, s_.discs);
    for (size_t k : again)
      for (MovingPart& part : s_.discs.moving) {
        if (part.object != changes[k].object) continue;
        s_.discs.clear_part(part);
        part.current = true;
        if (!s_.scene.objects[part.object].present) continue;
        for (uint32_t b = 0; b < affected_.near[k].size(); ++b)
          deposit.add_to_part(part, b, affected_.near[k][b]);
      }
    deposit.finish();
    again.clear();
  };
  return run_pending(budget_ms, between);
}

size_t Update::run_pending(double budget_ms, const std::function<void()>& between) {
  const Stopwatch own;
  const size_t total = s_.paths.pending.size();
  size_t done = 0;
  // Only stored segments can grow here; all other memory was admitted earlier.
  const size_t held = s_.paths.store.bytes(), other = s_.needed_bytes() - held;
  const size_t most =
      std::max(held, s_.options.memory_limit - std::min(other, s_.options.memory_limit));
  PathUpdate update(s_);
  progress_.announce("replace paths", total);
  // The first step, which always runs, also adds the samples of moved objects; from then on these
  // take part in every replacement, as static samples do.
  size_t step = budget_ms != 0 ? kFirstStep : kMaxPerStep;
  bool refused = false;
  do {
    // The number of paths that fit even if all were of the greatest length, so that a breach of the
    // limit is noticed early.
    const double longest = double(s_.options.max_bounces) * s_.paths.bytes_per_segment();
    const double room = double(most) - double(std::min(most, s_.paths.store.bytes()));
    const size_t fit = s_.options.memory_limit ? size_t(room / longest) : kMaxPerStep;
    const size_t end = std::min({total, done + step, done + std::max(kFirstStep, fit)});
    const size_t removed = update.counts().removed, retraced = update.counts().retraced;
    update.replace(std::span(s_.paths.pending).subspan(done, end - done), done ? nullptr : between);
    progress_.advance(end - done);
    done = end;
    // Paths that become shorter again need no more memory, though the store does not shrink.
    refused = s_.options.memory_limit && s_.paths.store.bytes() > most && done < total &&
              update.counts().retraced - retraced > update.counts().removed - removed;
    if (refused) break;
    if (budget_ms == 0 || done == total) continue;
    const double spent = own.milliseconds(), left = budget_ms - spent;
    if (left <= 0) break;
    const double fits = double(done) * left / spent;  // may exceed the range of integers
    step = size_t(std::clamp(fits, 1.0, double(std::min(2 * step, kMaxPerStep))));
  } while (done < total && !progress_.cancelled());
  s_.paths.pending.erase(s_.paths.pending.begin(), s_.paths.pending.begin() + long(done));
  s_.enter(Step::marked, Step::replaced);
  DELTALUX_ASSERT(agree(s_.paths));
  frame_.affected_paths = update.counts().paths;
  frame_.removed_segments = update.counts().removed;
  frame_.retraced_segments = update.counts().retraced;
  frame_.done =
      std::min(s_.direct.light->current_share(), total ? double(done) / double(total) : 1.0);
  frame_.milliseconds.emplace_back("remove", update.counts().remove_ms);
  frame_.milliseconds.emplace_back("moving samples", update.counts().moving_ms);
  frame_.milliseconds.emplace_back("trace", update.counts().trace_ms);
  frame_.milliseconds.emplace_back("deposit", update.counts().deposit_ms);
  return refused ? total - done : 0;
}

void Update::refuse_growth() {
  const double limit = double(s_.options.memory_limit), paths = double(s_.paths.cut.size());
  const double other = double(s_.needed_bytes() - s_.paths.store.bytes());
  const double longest = double(s_.options.max_bounces) * s_.paths.bytes_per_segment();
  if (!s_.options.memory_limit || other + paths * longest <= limit) return;
  const PilotPaths pilot = walk_pilot_paths(s_, progress_);
  const double needed =
      other + pilot.weight() * double(pilot.flights.size()) * s_.paths.bytes_per_segment();
  if (needed > limit && needed > double(s_.needed_bytes()))
    throw OptionError(
        "reflectance: memory: brighter surfaces make longer paths, which would need "
        "about " +
        mebibytes(needed) + ", the limit is " + mebibytes(limit) +
        "; set it back, raise the memory limit, or bake with fewer paths");
}

}  // namespace deltalux::session
