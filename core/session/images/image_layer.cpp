// SPDX-License-Identifier: Apache-2.0
// Casts the rays of places that are not kept, in blocks.
#include "session/images/image_layer.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>

#include "direct/light_by_need.h"
#include "session/rays/pilots.h"

namespace deltalux::session {
namespace {

constexpr size_t kGrain = 64;
// points between two reports of progress, for direct light alone
constexpr size_t kBatch = size_t(1) << 16;

}  // namespace

std::unique_ptr<KeptPlaces::Batch> ImageLayer::cast_from(std::vector<direct::Receiver> receivers,
                                                         std::span<const Vec3d> direct,
                                                         uint32_t count,
                                                         const gather::Evaluation& now) const {
  Progress part;
  std::vector<gather::SeenTargets> seen = rays.targets_at(receivers, count, part);
  std::vector<int8_t> doublings(receivers.size());
  gather::Guiding pilot_guiding;
  gather::GatherHits pilots({}, world.options.seed);
  if (needs_pilots(rays)) {
    const gather::RayCounts counts = pilot_rays_of(receivers.size(), count);
    pilot_guiding = rays.guiding_of(seen, counts);
    pilots = rays.hits_of(receivers, pilot_guiding, counts, world.options.seed ^ kPilotSeed, now);
    std::vector<gather::PilotEstimate> told;
    for (size_t i = 0; i < receivers.size(); ++i)
      told.push_back(pilot_of(rays, pilots, i, receivers[i], direct[i], now));
    doublings = doublings_of(rays, receivers, told, count);
  }
  const gather::RayCounts counts(doublings, count);
  gather::Guiding guiding = rays.guiding_of(seen, counts);
  gather::GatherHits hits = rays.hits_of(receivers, guiding, counts, world.options.seed, now);
  return std::make_unique<KeptPlaces::Batch>(KeptPlaces::Batch{
      count, std::move(receivers), std::move(seen), std::move(pilot_guiding), std::move(guiding),
      std::move(pilots), std::move(hits), std::move(doublings)});
}

void ImageLayer::follow(const gather::Evaluation& now, Progress& progress) {
  const auto cast_again = [&](gather::GatherHits& hits, const KeptPlaces::Batch& batch,
                              const gather::Guiding& guiding, const gather::Change& change) {
    if (!hits.samples()) return;
    Progress part;
    const gather::Context here = rays.context(batch.receivers, guiding);
    hits.note(here, change);
    hits.follow(here, world.workers, part, [](size_t) {}, [&] { return !progress.cancelled(); });
    progress.check();
  };
  try {
    kept->follow_changes([&](KeptPlaces::Batch& batch, const gather::Change& change) {
      gather::Change own = change;
      own.samples.assign(batch.receivers.size(), 0);
      if (rays.beams.placed(own.scene)) {
        Progress part;
        batch.seen = rays.targets_at(batch.receivers, batch.rays, part);
        const auto renew = [&](gather::Guiding& guiding, const gather::GatherHits& hits) {
          if (!hits.samples()) return;
          std::vector<gather::RayAllotment> allotments =
              rays.allotments_of(batch.seen, hits.rays());
          for (size_t i = 0; i < allotments.size(); ++i)
            own.samples[i] |= !(allotments[i] == guiding.allotments[i]);
          guiding.allotments = std::move(allotments);
        };
        renew(batch.pilot_guiding, batch.pilots);
        renew(batch.guiding, batch.hits);
      }
      cast_again(batch.pilots, batch, batch.pilot_guiding, own);
      cast_again(batch.hits, batch, batch.guiding, own);
    });
  } catch (...) {
    kept.reset();
    throw;
  }
  kept->each([&](KeptPlaces::Batch& batch) {
    batch.pilots.paint(now.paint(), world.workers);
    batch.hits.paint(now.paint(), world.workers);
  });
}

std::vector<KeptPlaces::Place> ImageLayer::find(const KeptPlaces& from,
                                                std::span<const direct::Receiver> receivers,
                                                std::span<const Vec3d> direct, uint32_t count,
                                                const gather::Evaluation& now) const {
  std::vector<KeptPlaces::Place> places(receivers.size());
  std::vector<uint32_t> numbers;
  std::vector<direct::Receiver> found;
  std::vector<gather::PilotEstimate> pilots;
  for (uint32_t i = 0; i < places.size(); ++i) {
    places[i] = from.find(receivers[i], count);
    const KeptPlaces::Batch* batch = places[i].batch;
    if (!batch || !needs_pilots(rays)) continue;
    numbers.push_back(i);
    found.push_back(receivers[i]);
    pilots.push_back(pilot_of(rays, batch->pilots, places[i].number, receivers[i], direct[i], now));
  }
  // A place that now needs another number of rays is not taken from what is kept.
  const std::vector<int8_t> doublings = doublings_of(rays, found, pilots, count);
  for (size_t k = 0; k < numbers.size(); ++k) {
    KeptPlaces::Place& place = places[numbers[k]];
    if (place.batch->doublings[place.number] != doublings[k]) place = {};
  }
  return places;
}

void ImageLayer::indirect_at(std::span<const direct::Receiver> receivers,
                             std::span<const Vec3d> direct, uint32_t count,
                             const gather::Evaluation& now, KeptPlaces* from, double* indirect,
                             double* noise) const {
  std::vector<KeptPlaces::Place> places(receivers.size());
  if (from) places = find(*from, receivers, direct, count, now);
  std::vector<direct::Receiver> others;
  std::vector<Vec3d> their_direct;
  for (size_t i = 0; i < places.size(); ++i) {
    if (places[i].batch) continue;
    others.push_back(receivers[i]);
    their_direct.push_back(direct[i]);
  }
  if (from) from->count_taken(places.size() - others.size());
  std::unique_ptr<KeptPlaces::Batch> all_cast;
  if (!others.empty()) all_cast = cast_from(std::move(others), their_direct, count, now);
  uint32_t number = 0;
  for (KeptPlaces::Place& place : places)
    if (!place.batch) place = {all_cast.get(), number++};
  world.workers.for_blocks(places.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto& [batch, k] = places[i];
      std::copy_n(now.read(batch->hits, k).irradiance, 3, indirect + 3 * i);
      if (noise) noise[i] = std::sqrt(double(now.pilot(batch->hits, k).variance));
    }
  });
  if (from && all_cast) from->keep(std::move(all_cast));
}

std::vector<Vec3d> ImageLayer::direct_of(std::span<const direct::Receiver> receivers, bool by_need,
                                         KeptPlaces* from, Progress& progress) const {
  std::vector<Vec3d> light(receivers.size());
  std::vector<uint32_t> numbers;
  std::vector<direct::Receiver> others;
  for (uint32_t i = 0; i < receivers.size(); ++i) {
    const Vec3d* own = from ? from->direct().find(receivers[i], by_need) : nullptr;
    if (own)
      light[i] = *own;
    else
      numbers.push_back(i), others.push_back(receivers[i]);
  }
  const std::vector<uint8_t> all(world.lights.size(), 1);
  std::vector<Vec3d> found(others.size());
  if (by_need)
    direct::light_by_need({*world.caster, world.lights, all, others}, dim_of_lights(),
                          world.options.seed, world.workers, progress, found);
  else
    found = irradiance_of(*rays.direct.at(others, all), world.group_factor, 0, others.size());
  for (size_t k = 0; k < numbers.size(); ++k) light[numbers[k]] = found[k];
  if (from) from->keep_direct(others, by_need, found);
  return light;
}

std::vector<double> ImageLayer::dim_of_lights() const {
  std::vector<double> dim;
  for (const trace::Light& light : world.lights) dim.push_back(world.group_factor[light.group]);
  return dim;
}

void ImageLayer::gather_at(std::span<const Vec3f> points, std::span<const Vec3f> normals,
                           const Asked& asked, double* direct, double* indirect, double* noise,
                           Progress& progress) {
  const uint32_t each = asked.rays ? asked.rays : world.options.gather_rays;
  if (asked.keep_bytes && !kept) kept = std::make_unique<KeptPlaces>(asked.keep_bytes);
  KeptPlaces* const from = asked.keep_bytes ? kept.get() : nullptr;
  if (from)
    from->direct().follow_changes(world.lights, dim_of_lights(),
                                  trace::shadow_slack(*world.caster));
  std::optional<gather::Evaluation> now;
  if (indirect) now = rays.evaluation(false);
  if (indirect && from) follow(*now, progress);
  const size_t together =
      indirect ? seen_together(gather::RayCounts::rays(each, gather::RayCounts::kMaxDoublings))
               : kBatch;
  progress.announce(indirect ? "gather" : "direct light", points.size());
  for (size_t first = 0; first < points.size(); first += together) {
    const size_t count = std::min(together, points.size() - first);
    const std::vector<direct::Receiver> receivers =
        rays.receivers_at(points.subspan(first, count), normals.subspan(first, count));
    const std::vector<Vec3d> straight = direct_of(receivers, asked.by_need, from, progress);
    if (direct)
      for (size_t i = 0; i < count; ++i)
        for (int c = 0; c < 3; ++c) direct[3 * (first + i) + size_t(c)] = straight[i][c];
    if (indirect)
      indirect_at(receivers, straight, each, *now, from, indirect + 3 * first,
                  noise ? noise + first : nullptr);
    progress.advance(count);
    progress.check();
  }
}

}  // namespace deltalux::session
