// SPDX-License-Identifier: Apache-2.0
// Which ray goes where.
#include "gather/sample_rays.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr float kWorth = 0.03f;  // of a sample's irradiance: less noise than this is let be
constexpr float kRest = 0.25f;   // what all other light weighs beside guides, of a sample's
constexpr uint32_t kLooks = 8;   // rays that tell whether a guide is seen

}  // namespace

RayShares share_rays(std::span<const Guide> guides, const direct::Receiver& receiver, uint32_t rays,
                     const trace::RayCaster& caster, uint64_t seed) {
  RayShares out;
  if (receiver.normal == Vec3f{}) return out;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  struct Candidate {
    float noise, irradiance;
    uint32_t guide;
  };
  std::vector<Candidate> candidates;
  for (uint32_t g = 0; g < guides.size(); ++g) {
    const Guide& guide = guides[g];
    const float seen = share_of_view(guide, origin, receiver.normal);
    const float noise = guide.brightest * std::sqrt(seen / float(rays));
    if (noise > kWorth * guide.around) candidates.push_back({noise, guide.radiosity * seen, g});
  }
  std::stable_sort(candidates.begin(), candidates.end(),
                   [](const Candidate& a, const Candidate& b) { return a.noise > b.noise; });
  if (candidates.size() > kMostUsed) candidates.resize(kMostUsed);
  float all = 0;
  for (Candidate& candidate : candidates) {
    const Guide& guide = guides[candidate.guide];
    const Target target(guide, origin);
    const PathRandom random(combine(seed, receiver.key), candidate.guide);
    uint32_t hits = 0;
    for (uint32_t k = 0; k < kLooks; ++k) {
      const Vec3f w = target.direction(random(k, 0), random(k, 1));
      if (!(dot(w, receiver.normal) > 0)) continue;
      const trace::Hit hit = caster.closest(origin, w);
      hits += hit.valid() && length(origin + w * hit.t - guide.centre) < 2 * guide.half;
    }
    candidate.irradiance *= float(hits) / kLooks;
    all += candidate.irradiance / guide.around;
  }
  // One eighth each, then in proportion to what they bring; at least half of the rays stay even.
  const uint32_t most = rays / (2 * kParts);
  const float more = float(most - std::min(most, uint32_t(candidates.size())));
  uint32_t left = most;
  for (size_t i = 0; i < candidates.size() && left > 0; ++i) {
    const float own = candidates[i].irradiance / guides[candidates[i].guide].around;
    if (!(own > 0)) continue;
    const uint32_t eighths = std::min(left, 1 + uint32_t(more * own / (all + kRest)));
    out.guide[i] = uint16_t(candidates[i].guide);
    out.eighth[i] = uint16_t(eighths);
    left -= eighths;
  }
  return out;
}

SampleRays::SampleRays(const Directions& directions, const Guiding& guiding, uint32_t sample,
                       const direct::Receiver& receiver)
    : directions_(directions),
      key_(receiver.key),
      origin_(receiver.point + receiver.normal * receiver.slack()),
      normal_(receiver.normal) {
  if (guiding.shares.empty()) return;
  shares_ = guiding.shares[sample];
  guided_ = shares_.guided();
  for (uint32_t slot = 0; slot < kMostUsed; ++slot)
    if (shares_.eighth[slot]) targets_[slot] = Target(guiding.guides[shares_.guide[slot]], origin_);
}

uint32_t SampleRays::ray_of_even(uint32_t number) const {
  uint32_t part = 0;
  while (number >= end_of(part) - (part + 1) * guided_) ++part;
  return number + part * guided_;
}

std::pair<uint32_t, uint32_t> SampleRays::slot_of(uint32_t ray) const {
  const uint32_t part = uint32_t((uint64_t(ray) * kParts + kParts - 1) / directions_.count());
  const uint32_t even = end_of(part) - guided_;
  if (ray < even) return {kMostUsed, ray - part * guided_};
  uint32_t number = ray - even, slot = 0;
  while (number >= shares_.eighth[slot]) number -= shares_.eighth[slot++];
  return {slot, part * shares_.eighth[slot] + number};
}

Vec3f SampleRays::direction(uint32_t ray) const {
  if (!guided_) return directions_(key_, ray, normal_);
  const auto [slot, number] = slot_of(ray);
  if (slot == kMostUsed) return directions_(key_, number, normal_);
  const auto [u, v] = directions_.point(key_, slot + 1, number);
  const Vec3f w = targets_[slot].direction(u, v);
  return dot(w, normal_) > 0 ? w : Vec3f{};
}

float SampleRays::weight(uint32_t ray) const {
  if (!guided_) return 1;
  const Vec3f w = direction(ray);
  const float cosine = dot(w, normal_);
  if (!(cosine > 0)) return 0;
  const float all = float(directions_.count());
  float density = cosine * (all - float(kParts * guided_));
  for (uint32_t slot = 0; slot < kMostUsed; ++slot)
    if (shares_.eighth[slot])
      density += float(kParts * shares_.eighth[slot]) * targets_[slot].density(w);
  return cosine * all / density;
}

}  // namespace deltalux::gather
