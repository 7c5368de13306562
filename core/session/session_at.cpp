// SPDX-License-Identifier: Apache-2.0
// Light at arbitrary points, such as the pixels of an image, and what is kept of it between edits.
#include <numeric>
#include <utility>

#include "direct/block.h"
#include "direct/light_by_need.h"
#include "gather/choose/slit.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

// gather rays cast between two checks for cancellation
constexpr size_t kTogether = size_t(1) << 22;
constexpr size_t kReceivers = 4096;  // receivers processed together, at most
constexpr size_t kGrain = 64;
// points between two reports of progress, for direct light alone
constexpr size_t kBatch = size_t(1) << 16;

}  // namespace

size_t Session::seen_together(uint32_t rays) {
  return std::clamp(kTogether / rays, kGrain, kReceivers);
}

gather::Guiding Session::guiding_of(std::span<const gather::SeenGuides> seen,
                                    const gather::RayCounts& rays) const {
  const State& s = *state_;
  return {s.guiding.guides, s.guiding.beams, s.guiding.suns, {}, {}, shares_of(seen, rays)};
}

gather::Looks Session::looks_of(std::span<const direct::Receiver> receivers,
                                const gather::Guiding& guiding, const gather::RayCounts& rays,
                                uint64_t seed, const gather::Evaluation& now) const {
  const State& s = *state_;
  Progress part;
  gather::Looks looks(rays, seed);
  looks.cast(present(receivers, guiding), s.workers, part);
  looks.paint(now.paint(), s.workers);
  return looks;
}

gather::RayCounts Session::pilot_rays_of(size_t receivers, uint32_t rays) {
  const std::vector<int8_t> few(receivers, int8_t(gather::RayCounts::kMinDoublings));
  return {few, rays};
}

gather::PilotLook Session::pilot_of(const gather::Looks& pilots, size_t number,
                                    const direct::Receiver& receiver, Vec3d direct,
                                    const gather::Evaluation& now) const {
  gather::PilotLook pilot = now.pilot(pilots, number);
  pilot.irradiance += float(direct.x + direct.y + direct.z);
  pilot.beside = state_->gather->beams.beside(receiver.point);
  return pilot;
}

std::vector<gather::PilotLook> Session::pilots_of(const Places& places, uint32_t rays,
                                                  const gather::Evaluation& now) const {
  const State& s = *state_;
  const gather::RayCounts counts = pilot_rays_of(places.receivers.size(), rays);
  const gather::Looks looks = looks_of(places.receivers, guiding_of(places.seen, counts), counts,
                                       s.options.seed ^ kPilotSeed, now);
  std::vector<gather::PilotLook> out(places.receivers.size());
  s.workers.for_blocks(out.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      out[i] = pilot_of(looks, i, places.receivers[i], places.direct[i], now);
  });
  return out;
}

bool Session::needs_pilots() const {
  const gather::RayNeed& need = state_->guiding.need;
  return need.noise > 0 || need.beside > 0;
}

std::vector<int8_t> Session::doublings_of(std::span<const direct::Receiver> receivers,
                                          std::span<const gather::PilotLook> pilots,
                                          uint32_t rays) const {
  const State& s = *state_;
  std::vector<int8_t> doublings(receivers.size());
  const gather::Present here = present(receivers, s.guiding);
  const gather::SlitFinder in_slit(here, s.options.seed);
  // A place that is dark while some lights are off or dimmed to 0 may be noisy once they are on.
  bool all_lit = true;
  for (const trace::Light& light : s.lights) all_lit &= light.on && s.group_factor[light.group] > 0;
  const int least = all_lit ? gather::RayCounts::kMinDoublings : 0;
  s.workers.for_blocks(doublings.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      int own = s.guiding.need.doublings(pilots[i], rays, least);
      if (own < 0 && !in_slit(receivers[i])) own = 0;
      doublings[i] = int8_t(own);
    }
  });
  return doublings;
}

std::unique_ptr<KeptPlaces::Batch> Session::look_from(std::vector<direct::Receiver> receivers,
                                                      std::span<const Vec3d> direct, uint32_t rays,
                                                      const gather::Evaluation& now) const {
  const State& s = *state_;
  Progress part;
  std::vector<gather::SeenGuides> seen = guides_at(receivers, rays, part);
  std::vector<int8_t> doublings(receivers.size());
  gather::Guiding pilot_guiding;
  gather::Looks pilots({}, s.options.seed);
  if (needs_pilots()) {
    const gather::RayCounts counts = pilot_rays_of(receivers.size(), rays);
    pilot_guiding = guiding_of(seen, counts);
    pilots = looks_of(receivers, pilot_guiding, counts, s.options.seed ^ kPilotSeed, now);
    std::vector<gather::PilotLook> told;
    for (size_t i = 0; i < receivers.size(); ++i)
      told.push_back(pilot_of(pilots, i, receivers[i], direct[i], now));
    doublings = doublings_of(receivers, told, rays);
  }
  const gather::RayCounts counts(doublings, rays);
  gather::Guiding guiding = guiding_of(seen, counts);
  gather::Looks looks = looks_of(receivers, guiding, counts, s.options.seed, now);
  return std::make_unique<KeptPlaces::Batch>(KeptPlaces::Batch{
      rays, std::move(receivers), std::move(seen), std::move(pilot_guiding), std::move(guiding),
      std::move(pilots), std::move(looks), std::move(doublings)});
}

void Session::follow_kept(const gather::Evaluation& now, Progress& progress) {
  const State& s = *state_;
  const auto follow = [&](gather::Looks& looks, const KeptPlaces::Batch& batch,
                          const gather::Guiding& guiding, const gather::Change& change) {
    if (!looks.samples()) return;
    Progress part;
    const gather::Present here = present(batch.receivers, guiding);
    looks.note(here, change);
    looks.follow(here, s.workers, part, [](size_t) {}, [&] { return !progress.cancelled(); });
    progress.check();
  };
  try {
    kept_->follow_changes([&](KeptPlaces::Batch& batch, const gather::Change& change) {
      gather::Change own = change;
      own.samples.assign(batch.receivers.size(), 0);
      if (s.gather->beams.placed(own.scene)) {
        Progress part;
        batch.seen = guides_at(batch.receivers, batch.rays, part);
        const auto renew = [&](gather::Guiding& guiding, const gather::Looks& looks) {
          if (!looks.samples()) return;
          std::vector<gather::RayShares> shares = shares_of(batch.seen, looks.rays());
          for (size_t i = 0; i < shares.size(); ++i)
            own.samples[i] |= !(shares[i] == guiding.shares[i]);
          guiding.shares = std::move(shares);
        };
        renew(batch.pilot_guiding, batch.pilots);
        renew(batch.guiding, batch.looks);
      }
      follow(batch.pilots, batch, batch.pilot_guiding, own);
      follow(batch.looks, batch, batch.guiding, own);
    });
  } catch (...) {
    kept_.reset();
    throw;
  }
  kept_->each([&](KeptPlaces::Batch& batch) {
    batch.pilots.paint(now.paint(), s.workers);
    batch.looks.paint(now.paint(), s.workers);
  });
}

std::vector<KeptPlaces::Place> Session::find_kept(const KeptPlaces& kept,
                                                  std::span<const direct::Receiver> receivers,
                                                  std::span<const Vec3d> direct, uint32_t rays,
                                                  const gather::Evaluation& now) const {
  std::vector<KeptPlaces::Place> places(receivers.size());
  std::vector<uint32_t> numbers;
  std::vector<direct::Receiver> found;
  std::vector<gather::PilotLook> pilots;
  for (uint32_t i = 0; i < places.size(); ++i) {
    places[i] = kept.find(receivers[i], rays);
    const KeptPlaces::Batch* batch = places[i].batch;
    if (!batch || !needs_pilots()) continue;
    numbers.push_back(i);
    found.push_back(receivers[i]);
    pilots.push_back(pilot_of(batch->pilots, places[i].number, receivers[i], direct[i], now));
  }
  // A place that now needs another number of rays is not taken from what is kept.
  const std::vector<int8_t> doublings = doublings_of(found, pilots, rays);
  for (size_t k = 0; k < numbers.size(); ++k) {
    KeptPlaces::Place& place = places[numbers[k]];
    if (place.batch->doublings[place.number] != doublings[k]) place = {};
  }
  return places;
}

void Session::indirect_at(std::span<const direct::Receiver> receivers,
                          std::span<const Vec3d> direct, uint32_t rays,
                          const gather::Evaluation& now, KeptPlaces* kept, double* indirect,
                          double* noise) const {
  std::vector<KeptPlaces::Place> places(receivers.size());
  if (kept) places = find_kept(*kept, receivers, direct, rays, now);
  std::vector<direct::Receiver> others;
  std::vector<Vec3d> their_direct;
  for (size_t i = 0; i < places.size(); ++i) {
    if (places[i].batch) continue;
    others.push_back(receivers[i]);
    their_direct.push_back(direct[i]);
  }
  if (kept) kept->count_taken(places.size() - others.size());
  std::unique_ptr<KeptPlaces::Batch> looked;
  if (!others.empty()) looked = look_from(std::move(others), their_direct, rays, now);
  uint32_t number = 0;
  for (KeptPlaces::Place& place : places)
    if (!place.batch) place = {looked.get(), number++};
  state_->workers.for_blocks(places.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto& [batch, k] = places[i];
      std::copy_n(now.read(batch->looks, k).irradiance, 3, indirect + 3 * i);
      if (noise) noise[i] = std::sqrt(double(now.pilot(batch->looks, k).variance));
    }
  });
  if (kept && looked) kept->keep(std::move(looked));
}

std::vector<Vec3d> Session::direct_of(std::span<const direct::Receiver> receivers, bool by_need,
                                      KeptPlaces* kept, Progress& progress) const {
  const State& s = *state_;
  std::vector<Vec3d> light(receivers.size());
  std::vector<uint32_t> numbers;
  std::vector<direct::Receiver> others;
  for (uint32_t i = 0; i < receivers.size(); ++i) {
    const Vec3d* own = kept ? kept->direct().find(receivers[i], by_need) : nullptr;
    if (own)
      light[i] = *own;
    else
      numbers.push_back(i), others.push_back(receivers[i]);
  }
  const std::vector<uint8_t> all(s.lights.size(), 1);
  std::vector<Vec3d> found(others.size());
  if (by_need)
    direct::light_by_need({*s.caster, s.lights, all, others}, dim_of_lights(), s.options.seed,
                          s.workers, progress, found);
  else
    found = irradiance_of(*s.direct.at(others, all), s.group_factor, 0, others.size());
  for (size_t k = 0; k < numbers.size(); ++k) light[numbers[k]] = found[k];
  if (kept) kept->keep_direct(others, by_need, found);
  return light;
}

std::vector<double> Session::dim_of_lights() const {
  std::vector<double> dim;
  for (const trace::Light& light : state_->lights) dim.push_back(state_->group_factor[light.group]);
  return dim;
}

void Session::gather_at(std::span<const Vec3f> points, std::span<const Vec3f> normals,
                        const Asked& asked, double* direct, double* indirect, double* noise,
                        Progress& progress) {
  check_readable();
  const State& s = *state_;
  if (!s.gather) throw OptionError("at: this session does not gather");
  const uint32_t rays = asked.rays ? asked.rays : s.options.gather_rays;
  if (asked.keep_bytes && !kept_) kept_ = std::make_unique<KeptPlaces>(asked.keep_bytes);
  KeptPlaces* const kept = asked.keep_bytes ? kept_.get() : nullptr;
  if (kept)
    kept->direct().follow_changes(s.lights, dim_of_lights(), trace::shadow_slack(*s.caster));
  std::optional<gather::Evaluation> now;
  if (indirect) now = evaluation(false);
  if (indirect && kept) follow_kept(*now, progress);
  const size_t together =
      indirect ? seen_together(gather::RayCounts::rays(rays, gather::RayCounts::kMaxDoublings))
               : kBatch;
  progress.announce(indirect ? "gather" : "direct light", points.size());
  for (size_t first = 0; first < points.size(); first += together) {
    const size_t count = std::min(together, points.size() - first);
    const std::vector<direct::Receiver> receivers =
        receivers_at(points.subspan(first, count), normals.subspan(first, count));
    const std::vector<Vec3d> straight = direct_of(receivers, asked.by_need, kept, progress);
    if (direct)
      for (size_t i = 0; i < count; ++i)
        for (int c = 0; c < 3; ++c) direct[3 * (first + i) + size_t(c)] = straight[i][c];
    if (indirect)
      indirect_at(receivers, straight, rays, *now, kept, indirect + 3 * first,
                  noise ? noise + first : nullptr);
    progress.advance(count);
    progress.check();
  }
}

}  // namespace deltalux::session
