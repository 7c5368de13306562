// SPDX-License-Identifier: Apache-2.0
// Pilot rays: a few per place tell how many it needs.
#pragma once
#include <span>
#include <vector>

#include "session/rays/ray_layer.h"

namespace deltalux::session {

inline constexpr uint64_t kPilotSeed = 0x70696c6f74212121ull;

/// Receivers that cast gather rays, the guides that each sees (empty if there are no guides), and
/// their direct light.
struct PilotReceivers {
  std::span<const direct::Receiver> receivers;
  std::span<const gather::SeenTargets> seen;
  std::span<const Vec3d> direct;
};

/// How many receivers, of so many rays each, are processed together.
size_t seen_together(uint32_t rays);
/// Ray counts for pilot rays, where `rays` is the standard number.
gather::RayCounts pilot_rays_of(size_t receivers, uint32_t rays);
/// Whether ray counts depend on pilot rays.
bool needs_pilots(const RayLayer& layer);
/// What pilot rays tell about the noise at each place; pilot_of(): at one place whose pilot rays
/// were cast already.
std::vector<gather::PilotEstimate> pilots_of(const RayLayer& layer, const PilotReceivers& places,
                                             uint32_t rays, const gather::Evaluation& now);
gather::PilotEstimate pilot_of(const RayLayer& layer, const gather::GatherHits& pilots,
                               size_t number, const direct::Receiver& receiver, Vec3d direct,
                               const gather::Evaluation& now);
/// How often each receiver doubles the standard number of `rays`; negative: halves.
std::vector<int8_t> doublings_of(const RayLayer& layer, std::span<const direct::Receiver> receivers,
                                 std::span<const gather::PilotEstimate> pilots, uint32_t rays);
/// The same for places whose pilot rays are cast first.
std::vector<int8_t> piloted(const RayLayer& layer, const PilotReceivers& places, uint32_t rays,
                            const gather::Evaluation& now);

}  // namespace deltalux::session
