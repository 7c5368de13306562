// SPDX-License-Identifier: Apache-2.0
// Decides where more rays, or fewer, are needed.
#include "gather/aim/ray_counts.h"

#include <cmath>
#include <limits>

namespace deltalux::gather {
namespace {

constexpr float kApart = 1.5f;  // a receiver is noisy only beyond this multiple of the mean noise
// Share of the variance at which rays double: below it, half of the rays suffice.
constexpr float kQuiet = 0.1f;
constexpr float kFiner = 0.8409f;  // 2^(-1/4)
constexpr float kDark = 0.1f;      // of the mean irradiance
// Error of the change for a cube that cuts the pool of a 4 degree spot: 18 % without additional
// rays, 8.5 % from 128 on, 5.5 % from 32 on, 5.0 % from 8 on.
constexpr float kBeside = 32, kMaxBeside = 1e12f;
constexpr double kShareBeside = 0.5;  // largest share of the additional rays

}  // namespace

float RayNeed::relative_noise(const PilotEstimate& pilot, uint32_t standard) const {
  const float few = float(RayCounts::rays(standard, RayCounts::kMinDoublings));
  const float noise =
      std::sqrt(pilot.variance * few / float(standard)) / std::max(pilot.irradiance, dark);
  return noise;
}

RayNeed::RayNeed(std::span<const PilotEstimate> pilots, uint32_t standard) {
  double sum = 0;
  for (const PilotEstimate& pilot : pilots) sum += double(pilot.irradiance);
  dark = kDark * float(sum / double(pilots.size()));
  if (!(dark > 0) || !std::isfinite(dark)) {
    dark = 0;
    return;
  }
  beside = kBeside;
  while (beside < kMaxBeside && more_rays(pilots, standard) > kShareBeside * kMoreRays) beside *= 2;
  float most = 0, mean = 0;
  for (const PilotEstimate& pilot : pilots) {
    const float own = relative_noise(pilot, standard);
    if (std::isfinite(own)) most = std::max(most, own), mean += own / float(pilots.size());
  }
  if (!(mean > std::numeric_limits<float>::min())) return;
  noise = most;
  while (noise * kFiner > kApart * mean) {
    const float coarser = noise;
    noise *= kFiner;
    if (more_rays(pilots, standard) <= kMoreRays) continue;
    noise = coarser;
    break;
  }
}

double RayNeed::more_rays(std::span<const PilotEstimate> pilots, uint32_t standard) const {
  double more = 0;
  for (const PilotEstimate& pilot : pilots)
    more += double((1 << doublings(pilot, standard, 0)) - 1);
  return more / double(pilots.size());
}

int RayNeed::doublings_beside(const PilotEstimate& pilot) const {
  int doublings = 0;
  while (beside > 0 && doublings < RayCounts::kMaxDoublings &&
         pilot.beside > std::ldexp(beside, doublings))
    ++doublings;
  return doublings;
}

int RayNeed::doublings(const PilotEstimate& pilot, uint32_t standard, int least) const {
  const float own = relative_noise(pilot, standard);
  int doublings = doublings_beside(pilot);
  if (!(noise > 0) || !std::isfinite(own)) return doublings;
  // Twice as many rays halve the variance.
  while (doublings < RayCounts::kMaxDoublings && own * own > std::ldexp(noise * noise, doublings))
    ++doublings;
  while (doublings <= 0 && doublings > least &&
         own * own <= std::ldexp(kQuiet * noise * noise, doublings - 1))
    --doublings;
  return doublings;
}

const char* RayNeed::flaw() const {
  for (float value : {noise, dark, beside})
    if (!(value >= 0) || !std::isfinite(value)) return "a need for rays that is not finite";
  return noise > 0 && !(dark > 0) ? "a need for rays in the dark" : nullptr;
}

}  // namespace deltalux::gather
