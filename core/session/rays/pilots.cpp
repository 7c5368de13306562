// SPDX-License-Identifier: Apache-2.0
// The rule for numbers of rays, RayNeed, is fixed at the bake.
#include "session/rays/pilots.h"

#include <algorithm>

#include "gather/choose/slit.h"

namespace deltalux::session {
namespace {

// gather rays cast between two checks for cancellation
constexpr size_t kTogether = size_t(1) << 22;
constexpr size_t kReceivers = 4096;  // receivers processed together, at most
constexpr size_t kGrain = 64;

}  // namespace

size_t seen_together(uint32_t rays) { return std::clamp(kTogether / rays, kGrain, kReceivers); }

gather::RayCounts pilot_rays_of(size_t receivers, uint32_t rays) {
  const std::vector<int8_t> few(receivers, int8_t(gather::RayCounts::kMinDoublings));
  return {few, rays};
}

bool needs_pilots(const RayLayer& layer) {
  const gather::RayNeed& need = layer.guiding.need;
  return need.noise > 0 || need.beside > 0;
}

gather::PilotEstimate pilot_of(const RayLayer& layer, const gather::GatherHits& pilots,
                               size_t number, const direct::Receiver& receiver, Vec3d direct,
                               const gather::Evaluation& now) {
  gather::PilotEstimate pilot = now.pilot(pilots, number);
  pilot.irradiance += float(direct.x + direct.y + direct.z);
  pilot.beside = layer.beams.beside(receiver.point);
  return pilot;
}

std::vector<gather::PilotEstimate> pilots_of(const RayLayer& layer, const PilotReceivers& places,
                                             uint32_t rays, const gather::Evaluation& now) {
  const World& world = layer.world;
  const gather::RayCounts counts = pilot_rays_of(places.receivers.size(), rays);
  const gather::GatherHits hits =
      layer.hits_of(places.receivers, layer.guiding_of(places.seen, counts), counts,
                    world.options.seed ^ kPilotSeed, now);
  std::vector<gather::PilotEstimate> out(places.receivers.size());
  world.workers.for_blocks(out.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i)
      out[i] = pilot_of(layer, hits, i, places.receivers[i], places.direct[i], now);
  });
  return out;
}

std::vector<int8_t> doublings_of(const RayLayer& layer, std::span<const direct::Receiver> receivers,
                                 std::span<const gather::PilotEstimate> pilots, uint32_t rays) {
  const World& world = layer.world;
  std::vector<int8_t> doublings(receivers.size());
  const gather::Context here = layer.context(receivers, layer.guiding);
  const gather::SlitFinder in_slit(here, world.options.seed);
  // A place that is dark while some lights are off or dimmed to 0 may be noisy once they are on.
  bool all_lit = true;
  for (const trace::Light& light : world.lights)
    all_lit &= light.on && world.group_factor[light.group] > 0;
  const int least = all_lit ? gather::RayCounts::kMinDoublings : 0;
  world.workers.for_blocks(doublings.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      int own = layer.guiding.need.doublings(pilots[i], rays, least);
      if (own < 0 && !in_slit(receivers[i])) own = 0;
      doublings[i] = int8_t(own);
    }
  });
  return doublings;
}

std::vector<int8_t> piloted(const RayLayer& layer, const PilotReceivers& places, uint32_t rays,
                            const gather::Evaluation& now) {
  return doublings_of(layer, places.receivers, pilots_of(layer, places, rays, now), rays);
}

}  // namespace deltalux::session
