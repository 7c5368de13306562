// SPDX-License-Identifier: Apache-2.0
// Shadow rays and gather rays of a bake that sessions with a part of the paths cast, each for
// ranges of the samples, and that the session without paths puts in place.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/error.h"
#include "session/bake/choice_light.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

constexpr const char* kFactors = "choice.factors";      // of light groups
constexpr const char* kRadiosity = "gather.radiosity";  // by cell, without direct light asked for

constexpr const char* kSame =
    "; give those of sessions of the same scene, samples, options and edits";

[[noreturn]] void refuse(const std::string& what) {
  throw OptionError("gather rays: found " + what + kSame);
}

/// Whether these may be guides that a receiver sees, of so many.
bool is_sound(const gather::SeenGuides& seen, size_t guides, size_t beams) {
  if (seen.count > gather::kMaxUsed) return false;
  return std::all_of(seen.each.begin(), seen.each.begin() + seen.count, [&](const auto& own) {
    const bool is_beam = own.guide >= gather::RayShares::kFirstBeam;
    return own.share >= 0 && std::isfinite(own.share) &&
           size_t(own.guide - (is_beam ? gather::RayShares::kFirstBeam : 0)) <
               (is_beam ? beams : guides);
  });
}

}  // namespace

void Session::begin_look(const FirstFlights& others, Progress& progress) {
  if (!may_look(others)) return;
  choose_look([&] {
    cover_cells(progress);
    auto looking = std::make_unique<Looking>();
    looking->factors = choice_factors(*state_);
    const ChoiceLight choice(*state_, looking->factors);
    const gather::Evaluation now = choose_guides(others, progress);
    looking->lit = choose_need(now);
    looking_ = std::move(looking);
  });
}

const Session::Looking& Session::looking(std::optional<bool> counted) const {
  if (!looking_ || (counted && *counted != (looking_->looks.samples() > 0)))
    throw OptionError(
        "gather rays: found a session that does not wait for this, expected begin_look(), "
        "take_numbers(), and take_looks() until there are those of all samples");
  return *looking_;
}

ArchiveView Session::save_look() const {
  looking();
  ArchiveView archive;
  state_->guiding.save_samples(0, 0, archive);
  archive.append(kRadiosity, state_->gather->light.all());
  archive.append(kFactors, looking().factors);
  return archive;
}

void Session::place_samples() {
  check_whole();
  if (!baked_ || state_->evaluates())
    throw OptionError(
        "rays: found a session that casts none for others, expected a baked one with a part of "
        "the paths");
  state_->direct.place();
}

direct::DirectLight Session::cast_direct(size_t first, size_t last, Progress& progress) const {
  const State& s = *state_;
  check_joined(first, last);
  direct::DirectLight direct(last - first, s.direct.light->scales(), s.options.seed);
  direct.compute({*s.caster, s.lights, s.light_sampled,
                  std::span(s.direct.receivers).subspan(first, last - first)},
                 s.workers, progress);
  return direct;
}

void Session::take_direct(size_t first, size_t last, ArchiveSource& archive) {
  if (!awaited_direct_)
    throw OptionError("take_direct: found a session that waits for no direct light");
  awaited_direct_->check_missing(first, last);
  state_->direct.light->restore_samples(first, last - first, archive);
  awaited_direct_->take(first, last);
  if (awaited_direct_->over()) awaited_direct_.reset();
}

void Session::join_look(ArchiveSource& archive) {
  State& s = *state_;
  place_samples();
  if (!s.gather) throw OptionError("join_look: found a session that does not gather");
  gather::Guiding guiding;
  guiding.restore(archive, s.lights, 0, s.options.gather_rays);
  auto radiosity =
      archive.read_all<gather::CellLight::Radiosity>(kRadiosity, s.gather->cells.size());
  for (const gather::CellLight::Radiosity& own : radiosity)
    for (const float channel : own)
      if (!(channel >= 0) || !std::isfinite(channel))
        throw FormatError("\"" + std::string(kRadiosity) +
                          "\": found a negative or non-finite value");
  auto factors = archive.read_all<double>(kFactors, s.group_factor.size());
  for (const double factor : factors)
    if (!(factor >= 0) || !std::isfinite(factor))
      throw FormatError("\"" + std::string(kFactors) + "\": found a factor that is none");
  if (s.lights_by_shadow_ray() != s.lights_by_shadow_ray(guiding))
    refuse("other lights with shadow rays than ask_for() was told");
  s.guiding = std::move(guiding);
  place_beams_and_suns();
  s.gather->light.take(std::move(radiosity));
  joined_factors_ = std::move(factors);
}

void Session::check_joined(size_t first, size_t last) const {
  if (state_->evaluates() || state_->direct.receivers.empty())
    throw OptionError(
        "rays: found a session that casts none for others; call place_samples() or join_look()");
  Awaited::check(first, last, state_->direct.receivers.size());
}

std::vector<Vec3d> Session::direct_of_samples(size_t first, size_t last) const {
  const std::vector<double>& factors = looking(false).factors;
  Awaited::check(first, last, state_->direct.receivers.size());
  return irradiance_of(*state_->direct.light, factors, first, last - first);
}

RayNumbers Session::number_rays(size_t first, std::span<const Vec3d> direct,
                                Progress& progress) const {
  State& s = *state_;
  check_joined(first, first + direct.size());
  const ChoiceLight choice(s, joined_factors_.empty() ? s.group_factor : joined_factors_);
  const std::span receivers = std::span(s.direct.receivers).subspan(first, direct.size());
  progress.begin("find noisy places", receivers.size());
  RayNumbers out{guides_at(receivers, s.options.gather_rays, progress),
                 std::vector<int8_t>(receivers.size())};
  if (needs_pilots()) out.doublings = piloted({receivers, out.seen, direct}, *evaluation(false));
  return out;
}

void Session::take_numbers(RayNumbers numbers) {
  State& s = *state_;
  looking(false);
  const size_t samples = s.samples.size(), guided = s.guiding.empty() ? 0 : samples;
  if (numbers.doublings.size() != samples || numbers.seen.size() != guided)
    refuse("numbers of rays for " + std::to_string(numbers.doublings.size()) + " of " +
           std::to_string(samples) + " samples");
  for (const int8_t own : numbers.doublings)
    if (own < gather::RayCounts::kMinDoublings || own > gather::RayCounts::kMaxDoublings)
      refuse("a number of rays that no sample has");
  for (const gather::SeenGuides& seen : numbers.seen)
    if (!is_sound(seen, s.guiding.guides.size(), s.guiding.beams.size()))
      refuse("a guide that is not there");
  s.guiding.doublings = std::move(numbers.doublings);
  if (looking_->lit) fit_rays();
  looking_->looks = uncast(numbers.seen);
  looking_->looks.clear(s.guiding);
  looking_->awaited = Awaited(samples);
}

std::vector<uint64_t> Session::look_cuts(uint64_t rays) const {
  const gather::RayCounts& counts = looking(true).looks.rays();
  std::vector<uint64_t> cuts{0};
  for (size_t i = 1; i <= counts.receivers(); ++i)
    if (i == counts.receivers() || counts.first(i) - counts.first(cuts.back()) >= rays)
      cuts.push_back(i);
  return cuts;
}

ArchiveView Session::save_aims(size_t first, size_t last) const {
  looking(true);
  Awaited::check(first, last, state_->samples.size());
  ArchiveView archive;
  state_->guiding.save_samples(first, last, archive);
  return archive;
}

gather::Looks Session::cast_looks(size_t first, size_t last, ArchiveSource& archive,
                                  Progress& progress) const {
  const State& s = *state_;
  check_joined(first, last);
  gather::Guiding aims;
  aims.restore(archive, s.lights, last - first, s.options.gather_rays);
  gather::Looks looks({aims.doublings, s.options.gather_rays}, s.options.seed);
  looks.cast(present(std::span(s.direct.receivers).subspan(first, last - first), aims), s.workers,
             progress);
  return looks;
}

void Session::take_looks(size_t first, size_t last, ArchiveSource& archive) {
  State& s = *state_;
  looking(true);
  looking_->awaited.check_missing(first, last);
  Progress part;
  looking_->looks.restore_samples(first, last, archive, present(s.direct.receivers, s.guiding),
                                  part);
  looking_->awaited.take(first, last);
  if (!looking_->awaited.over()) return;
  s.gather->looks = std::move(looking_->looks);
  looking_.reset();
}

}  // namespace deltalux::session
