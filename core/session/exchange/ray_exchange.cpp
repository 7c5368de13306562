// SPDX-License-Identifier: Apache-2.0
// Gather rays and shadow rays of a bake: what one session chooses, what others cast of it.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "base/error.h"
#include "session/bake/bake.h"
#include "session/bake/choices.h"
#include "session/bake/choose_rays.h"
#include "session/exchange/exchange.h"

namespace deltalux::session {
namespace {

[[noreturn]] void refuse(const std::string& what) {
  throw OptionError("gather rays: found " + what + kSame);
}

/// Whether these may be targets that a receiver sees, of so many.
bool is_sound(const gather::SeenTargets& seen, size_t guides, size_t beams) {
  if (seen.count > gather::kMaxUsed) return false;
  return std::all_of(seen.each.begin(), seen.each.begin() + seen.count, [&](const auto& own) {
    return own.share >= 0 && std::isfinite(own.share) &&
           gather::Targets::has(own.target, guides, beams);
  });
}

/// Runs `work`; if that throws, the session is as it was.
void try_gather(State& s, const std::function<void()>& work) {
  const Forecast forecast = s.forecast;
  const gather::Guiding guiding = s.rays.guiding;
  try {
    work();
  } catch (...) {
    s.rays.clear();
    s.rays.guiding = guiding;
    s.forecast = forecast;
    throw;
  }
}

}  // namespace

bool Exchange::may_gather() const {
  const State& s = state_;
  check_whole(s);
  if (!s.baked || !s.holds_none())
    throw OptionError(
        "gather: found a session that holds paths or is not baked, expected a baked one of "
        "path_range=(0, 0)");
  check_added(s);
  if (s.sharing.begun)
    throw OptionError(
        "gather: found a session that waits for gather rays of others; add those that it lacks, or "
        "bake again");
  if (!s.gathers() || s.rays.all_cast()) return false;
  if (s.sharing.awaited_direct) check_gathered(s);
  return true;
}

void Exchange::gather(Progress& progress) {
  State& s = state_;
  if (!may_gather()) return;
  try_gather(s, [&] {
    s.rays.guiding.doublings = choose_all_doublings(s, progress);
    gather_light(s, progress, true);
  });
}

void Exchange::begin_gather(Progress& progress) {
  State& s = state_;
  if (!may_gather()) return;
  try_gather(s, [&] {
    s.cells.cover(progress);
    s.rays.place();
    s.sharing.begun = std::make_unique<BegunGather>();
  });
}

const BegunGather& Exchange::begun(std::optional<bool> counted) const {
  const State& s = state_;
  if (!s.sharing.begun || (counted && *counted != (s.sharing.begun->hits.samples() > 0)))
    throw OptionError(
        "gather rays: found a session that does not wait for this, expected begin_gather(), "
        "take_numbers(), and take_hits() until there are those of all samples");
  return *s.sharing.begun;
}

void Exchange::place_samples() {
  State& s = state_;
  check_whole(s);
  if (!s.baked || s.evaluates())
    throw OptionError(
        "rays: found a session that casts none for others, expected a baked one with a part of "
        "the paths");
  s.direct.place();
  if (s.gathers()) s.rays.place();
}

direct::DirectLight Exchange::cast_direct(size_t first, size_t last, Progress& progress) const {
  const State& s = state_;
  check_placed(first, last);
  direct::DirectLight direct(last - first, s.direct.light->scales(), s.options.seed);
  direct.compute({*s.caster, s.lights, s.light_sampled,
                  std::span(s.direct.receivers).subspan(first, last - first)},
                 s.workers, progress);
  return direct;
}

void Exchange::take_direct(size_t first, size_t last, ArchiveSource& archive) {
  State& s = state_;
  if (!s.sharing.awaited_direct)
    throw OptionError("take_direct: found a session that waits for no direct light");
  s.sharing.awaited_direct->check_missing(first, last);
  s.direct.light->restore_samples(first, last - first, archive);
  s.sharing.awaited_direct->take(first, last);
  if (s.sharing.awaited_direct->over()) s.sharing.awaited_direct.reset();
}

void Exchange::check_placed(size_t first, size_t last) const {
  const State& s = state_;
  if (s.evaluates() || s.direct.receivers.empty())
    throw OptionError("rays: found a session that casts none for others; call place_samples()");
  Awaited::check(first, last, s.direct.receivers.size());
}

RayNumbers Exchange::number_rays(size_t first, size_t last, Progress& progress) {
  check_placed(first, last);
  return session::number_rays(state_, first, last, progress);
}

void Exchange::take_numbers(RayNumbers numbers) {
  State& s = state_;
  begun(false);
  const size_t samples = s.samples.size(), guided = s.rays.guiding.empty() ? 0 : samples;
  if (numbers.doublings.size() != samples || numbers.seen.size() != guided)
    refuse("numbers of rays for " + std::to_string(numbers.doublings.size()) + " of " +
           std::to_string(samples) + " samples");
  for (const int8_t own : numbers.doublings)
    if (own < gather::RayCounts::kMinDoublings || own > gather::RayCounts::kMaxDoublings)
      refuse("a number of rays that no sample has");
  for (const gather::SeenTargets& seen : numbers.seen)
    if (!is_sound(seen, s.rays.guiding.guides.size(), s.rays.guiding.beams.size()))
      refuse("a guide that is not there");
  s.rays.guiding.doublings = std::move(numbers.doublings);
  s.sharing.choices.reset();
  fit_rays(s);
  s.sharing.begun->hits = s.rays.uncast(numbers.seen);
  s.sharing.begun->hits.clear(s.rays.guiding);
  s.sharing.begun->awaited = Awaited(samples);
}

std::vector<uint64_t> Exchange::ray_cuts(uint64_t rays) const {
  const gather::RayCounts& counts = begun(true).hits.rays();
  std::vector<uint64_t> cuts{0};
  for (size_t i = 1; i <= counts.receivers(); ++i)
    if (i == counts.receivers() || counts.first(i) - counts.first(cuts.back()) >= rays)
      cuts.push_back(i);
  return cuts;
}

ArchiveView Exchange::save_aims(size_t first, size_t last) const {
  const State& s = state_;
  begun(true);
  Awaited::check(first, last, s.samples.size());
  ArchiveView archive;
  s.rays.guiding.save_samples(first, last, archive);
  return archive;
}

gather::GatherHits Exchange::cast_gather_rays(size_t first, size_t last, ArchiveSource& archive,
                                              Progress& progress) {
  State& s = state_;
  check_placed(first, last);
  s.sharing.choices.reset();
  gather::Guiding aims;
  aims.restore(archive, s.lights, last - first, s.options.gather_rays);
  gather::GatherHits hits({aims.doublings, s.options.gather_rays}, s.options.seed);
  hits.cast(s.rays.context(std::span(s.direct.receivers).subspan(first, last - first), aims),
            s.workers, progress);
  return hits;
}

void Exchange::take_hits(size_t first, size_t last, ArchiveSource& archive) {
  State& s = state_;
  begun(true);
  s.sharing.begun->awaited.check_missing(first, last);
  Progress part;
  s.sharing.begun->hits.restore_samples(first, last, archive, s.rays.context(), part);
  s.sharing.begun->awaited.take(first, last);
  if (!s.sharing.begun->awaited.over()) return;
  s.rays.hits = std::move(s.sharing.begun->hits);
  s.sharing.begun.reset();
}

}  // namespace deltalux::session
