// SPDX-License-Identifier: Apache-2.0
// Gather rays and shadow rays of a bake: what one session chooses, what others cast of it.
#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <utility>

#include "base/error.h"
#include "session/bake/bake.h"
#include "session/bake/choice_light.h"
#include "session/bake/choose_guides.h"
#include "session/bake/choose_rays.h"
#include "session/exchange/exchange.h"
#include "session/rays/pilots.h"

namespace deltalux::session {
namespace {

constexpr const char* kFactors = "choice.factors";      // of light groups
constexpr const char* kRadiosity = "gather.radiosity";  // by cell, without direct light asked for
constexpr const char* kCaustics = "gather.caustics";    // irradiance by cell, where there are any

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

/// Throws OptionError unless these are first flights of `lights` to so many cells.
void check_flights(const FirstFlights& flights, const std::vector<uint32_t>& lights,
                   uint64_t cells) {
  if (flights.lights != lights)
    throw OptionError(
        "gather: found first flights of other lights than the narrow and parallel ones of the "
        "scene; give the sum of the first_flights of all ranges");
  if (flights.cells != cells || flights.at.size() != flights.quanta.size() ||
      std::adjacent_find(flights.at.begin(), flights.at.end(), std::greater_equal{}) !=
          flights.at.end() ||
      (!flights.at.empty() && flights.at.back() >= lights.size() * cells * kBatches))
    throw OptionError("gather: found first flights to " + std::to_string(flights.cells) +
                      " cells, or not in order, expected " + std::to_string(cells) + kSame);
}

/// Light of so many cells.
std::vector<gather::CellLight::Radiosity> read_light(ArchiveSource& archive, const char* name,
                                                     size_t cells) {
  auto light = archive.read_all<gather::CellLight::Radiosity>(name, cells);
  for (const gather::CellLight::Radiosity& own : light)
    for (const float channel : own)
      if (!(channel >= 0) || !std::isfinite(channel))
        throw FormatError("\"" + std::string(name) + "\": found a negative or non-finite value");
  return light;
}

/// Runs `choose`; if that throws, the session is as it was.
void choose_gather(State& s, const std::function<void()>& choose) {
  const gather::CellSums before = s.cells.sums;
  const Forecast forecast = s.forecast;
  try {
    choose();
  } catch (...) {
    s.rays.guiding = {};
    s.rays.beams = {}, s.rays.suns = {};
    s.rays.hits = gather::GatherHits({}, s.options.seed);
    s.cells.sums = before;
    s.forecast = forecast;
    s.cells.touch_all();
    throw;
  }
}

}  // namespace

bool Exchange::may_gather(const FirstFlights& others) const {
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
  check_flights(others, guide_candidates(s), s.cells.division.size());
  return true;
}

void Exchange::gather(const FirstFlights& others, Progress& progress) {
  State& s = state_;
  if (may_gather(others)) choose_gather(s, [&] { gather_light(s, progress, true, others); });
}

void Exchange::begin_gather(const FirstFlights& others, Progress& progress) {
  State& s = state_;
  if (!may_gather(others)) return;
  choose_gather(s, [&] {
    s.cells.cover(progress);
    auto begun = std::make_unique<BegunGather>();
    begun->factors = choice_factors(s);
    const ChoiceLight choice(s, begun->factors);
    const gather::Evaluation now = choose_guides(s, others, progress);
    begun->lit = choose_need(s, now);
    s.sharing.begun = std::move(begun);
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

ArchiveView Exchange::save_gather() const {
  const State& s = state_;
  begun();
  ArchiveView archive;
  s.rays.guiding.save_samples(0, 0, archive);
  archive.append(kRadiosity, s.cells.light.all());
  archive.append(kCaustics, std::span(s.cells.light.caustics()));
  archive.append(kFactors, begun().factors);
  return archive;
}

void Exchange::place_samples() {
  State& s = state_;
  check_whole(s);
  if (!s.baked || s.evaluates())
    throw OptionError(
        "rays: found a session that casts none for others, expected a baked one with a part of "
        "the paths");
  s.direct.place();
}

direct::DirectLight Exchange::cast_direct(size_t first, size_t last, Progress& progress) const {
  const State& s = state_;
  check_joined(first, last);
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

void Exchange::join_gather(ArchiveSource& archive) {
  State& s = state_;
  place_samples();
  if (!s.gathers()) throw OptionError("join_gather: found a session that does not gather");
  gather::Guiding guiding;
  guiding.restore(archive, s.lights, 0, s.options.gather_rays);
  const size_t cells = s.cells.division.size();
  auto radiosity = read_light(archive, kRadiosity, cells);
  auto caustics = read_light(archive, kCaustics, s.has_caustics() ? cells : 0);
  auto factors = archive.read_all<double>(kFactors, s.group_factor.size());
  for (const double factor : factors)
    if (!(factor >= 0) || !std::isfinite(factor))
      throw FormatError("\"" + std::string(kFactors) + "\": found a factor that is none");
  if (s.rays.lights_by_shadow_ray() != s.rays.lights_by_shadow_ray(guiding))
    refuse("other lights with shadow rays than ask_for() was told");
  s.rays.guiding = std::move(guiding);
  s.rays.place();
  s.cells.light.take(std::move(radiosity), std::move(caustics));
  s.sharing.joined_factors = std::move(factors);
}

void Exchange::check_joined(size_t first, size_t last) const {
  const State& s = state_;
  if (s.evaluates() || s.direct.receivers.empty())
    throw OptionError(
        "rays: found a session that casts none for others; call place_samples() or join_gather()");
  Awaited::check(first, last, s.direct.receivers.size());
}

std::vector<Vec3d> Exchange::direct_of_samples(size_t first, size_t last) const {
  const State& s = state_;
  const std::vector<double>& factors = begun(false).factors;
  Awaited::check(first, last, s.direct.receivers.size());
  return irradiance_of(*s.direct.light, factors, first, last - first);
}

RayNumbers Exchange::number_rays(size_t first, std::span<const Vec3d> direct,
                                 Progress& progress) const {
  State& s = state_;
  check_joined(first, first + direct.size());
  const ChoiceLight choice(
      s, s.sharing.joined_factors.empty() ? s.group_factor : s.sharing.joined_factors);
  const std::span receivers = std::span(s.direct.receivers).subspan(first, direct.size());
  progress.begin("find noisy places", receivers.size());
  RayNumbers out{s.rays.targets_at(receivers, s.options.gather_rays, progress),
                 std::vector<int8_t>(receivers.size())};
  if (needs_pilots(s.rays))
    out.doublings = piloted(s.rays, {receivers, out.seen, direct}, s.options.gather_rays,
                            s.rays.evaluation(false));
  return out;
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
  if (s.sharing.begun->lit) fit_rays(s);
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
                                              Progress& progress) const {
  const State& s = state_;
  check_joined(first, last);
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
