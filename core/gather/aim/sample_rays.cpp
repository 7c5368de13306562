// SPDX-License-Identifier: Apache-2.0
// Decides where each ray of a sample goes.
#include "gather/aim/sample_rays.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace deltalux::gather {
namespace {

// Share of a sample's irradiance: targets whose noise is lower are ignored.
constexpr float kWorth = 0.01f;
// weight of all other light beside targets, relative to a sample's irradiance
constexpr float kRest = 0.25f;
constexpr float kMaxShare = 1e20f;  // larger shares are not finite
constexpr size_t kMaxAsked = 32;  // targets that a sample tests for visibility, the noisiest first
constexpr uint32_t kTries = 8;    // rays that test how much of a target is visible
// if none of those sees it: even through a slit a target can be bright
constexpr uint32_t kMaxTries = 64;
constexpr uint32_t kAllLooks = 512;  // per sample, approximately

/// A target that a sample may cast rays to.
struct Candidate {
  float noise, share;  ///< if all of it were visible
  size_t target;
  uint32_t tries = 0, hits = 0;
  float seen() const { return float(hits) / float(tries); }
};

/// Tests the visibility of the noisiest candidates with a few rays each, then of those not seen yet
/// with more rays. Keeps the noisiest visible ones. test(candidates): casts kTries more rays for
/// each.
template <class Look>
void keep_seen(std::vector<Candidate>& candidates, const Look& test) {
  const auto by_noise = [](const Candidate& a, const Candidate& b) { return a.noise > b.noise; };
  std::stable_sort(candidates.begin(), candidates.end(), by_noise);
  if (candidates.size() > kMaxAsked) candidates.resize(kMaxAsked);
  std::vector<Candidate*> asked;
  for (Candidate& own : candidates) asked.push_back(&own);
  uint32_t all = 0;
  while (!asked.empty()) {
    test(asked);
    all += uint32_t(asked.size()) * kTries;
    std::erase_if(asked,
                  [](const Candidate* own) { return own->hits > 0 || own->tries >= kMaxTries; });
    asked.resize(std::min(asked.size(), size_t(kAllLooks - std::min(kAllLooks, all)) / kTries));
  }
  std::erase_if(candidates, [](const Candidate& own) { return own.hits == 0; });
  for (Candidate& own : candidates) own.noise *= std::sqrt(own.seen()), own.share *= own.seen();
  std::stable_sort(candidates.begin(), candidates.end(), by_noise);
  if (candidates.size() > kMaxUsed) candidates.resize(kMaxUsed);
}

}  // namespace

SeenTargets see_targets(const Targets& targets, const direct::Receiver& receiver, uint32_t rays,
                        const trace::RayCaster& caster, uint64_t seed) {
  SeenTargets out;
  if (receiver.normal == Vec3f{}) return out;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  std::vector<Candidate> candidates;
  for (size_t i = 0; i < targets.size(); ++i) {
    const Expected own = targets[i].expected(origin, receiver.normal);
    const float noise = std::sqrt(own.square / float(rays)) / own.around;
    const float share = own.irradiance / own.around;
    if (noise > kWorth) candidates.push_back({noise, share < kMaxShare ? share : kMaxShare, i});
  }
  VisibilityTest test(caster, origin, receiver.normal);
  keep_seen(candidates, [&](std::span<Candidate* const> asked) {
    for (Candidate* own : asked) {
      const PathRandom random(combine(seed, receiver.key), targets.number(own->target));
      for (const uint32_t end = own->tries + kTries; own->tries < end; ++own->tries)
        targets[own->target].look(own->tries, random, test, own->hits);
    }
    test.cast();
  });
  for (const Candidate& candidate : candidates)
    if (candidate.share > 0)
      out.each[out.count++] = {candidate.share, targets.number(candidate.target)};
  return out;
}

RayAllotment allot_rays(const SeenTargets& seen, uint32_t rays) {
  RayAllotment out;
  float all = 0;
  for (uint32_t i = 0; i < seen.count; ++i) all += seen.each[i].share;
  // One ray per part for each guide, the rest in proportion to the guides' light; at least half of
  // all rays stay cosine-distributed.
  const uint32_t most = rays / (2 * kParts);
  const float more = float(most - std::min(most, seen.count));
  uint32_t left = most;
  for (uint32_t i = 0; i < seen.count && left > 0; ++i) {
    const SeenTargets::Seen& own = seen.each[i];
    const uint32_t eighths = std::min(left, 1 + uint32_t(more * own.share / (all + kRest)));
    out.target[i] = own.target;
    out.eighth[i] = uint16_t(eighths);
    left -= eighths;
  }
  return out;
}

SampleRays::SampleRays(const Directions& directions, std::span<const RayAllotment> allotments,
                       const Targets& targets, uint32_t sample, uint32_t rays,
                       const direct::Receiver& receiver)
    : directions_(directions),
      key_(receiver.key),
      count_(rays),
      origin_(receiver.point + receiver.normal * receiver.slack()),
      normal_(receiver.normal) {
  if (allotments.empty()) return;
  allotment_ = allotments[sample];
  guided_ = allotment_.guided();
  for (uint32_t slot = 0; slot < kMaxUsed; ++slot) {
    if (!allotment_.eighth[slot]) continue;
    target_[slot] = &targets.numbered(allotment_.target[slot]);
    if (const Guide* guide = target_[slot]->square()) squares_.set(slot, *guide);
  }
}

uint32_t SampleRays::ray_of_even(uint32_t number) const {
  if (!guided_) return number;
  // Parts have about equally many.
  uint32_t part = uint32_t(uint64_t(number) * kParts / (count_ - kParts * guided_));
  while (part && number < end_of(part - 1) - part * guided_) --part;
  while (number >= end_of(part) - (part + 1) * guided_) ++part;
  return number + part * guided_;
}

std::pair<uint32_t, uint32_t> SampleRays::slot_of(uint32_t ray) const {
  const uint32_t part = uint32_t((uint64_t(ray) * kParts + kParts - 1) / count_);
  const uint32_t even = end_of(part) - guided_;
  if (ray < even) return {kMaxUsed, ray - part * guided_};
  uint32_t number = ray - even, slot = 0;
  while (number >= allotment_.eighth[slot]) number -= allotment_.eighth[slot++];
  return {slot, part * allotment_.eighth[slot] + number};
}

Aim SampleRays::aim(uint32_t ray) const {
  if (!guided_) return {directions_(key_, ray, normal_)};
  const auto [slot, number] = slot_of(ray);
  if (slot == kMaxUsed) return {directions_(key_, number, normal_)};
  const auto [u, v] = directions_.point(key_, slot + 1, number);
  Aim aim = target_[slot]->aim(origin_, u, v);
  if (!(dot(aim.w, normal_) > 0)) aim.w = {};
  return aim;
}

std::array<float, 2> SampleRays::beyond(uint32_t ray) const {
  if (!guided_) return directions_.beyond(key_, 0, ray);
  const auto [slot, number] = slot_of(ray);
  return directions_.beyond(key_, slot == kMaxUsed ? 0 : slot + 1, number);
}

float SampleRays::weight(uint32_t ray, Vec3f w, float t, const direct::Receiver& at,
                         const trace::RayCaster& caster, bool& in_beam) const {
  if (!guided_) return 1;
  const float cosine = dot(w, normal_);
  if (!(cosine > 0)) return 0;
  const uint32_t own_slot = slot_of(ray).first;
  const float all = float(count_);
  PowerHeuristic heuristic(double(cosine * (all - float(kParts * guided_))), own_slot == kMaxUsed);
  alignas(64) std::array<float, kMaxUsed> may;
  squares_.may_meet(origin_, w, kMaxUsed, may);  // 1 for what is no square
  const LandedRay landed{origin_, w, t, at, caster};
  for (uint32_t slot = 0; slot < kMaxUsed; ++slot) {
    if (!target_[slot] || (!(may[slot] > 0) && slot != own_slot)) continue;
    const float density = target_[slot]->density(landed, in_beam);
    heuristic.add(double(kParts * allotment_.eighth[slot]) * double(density), slot == own_slot);
  }
  return heuristic.weight(double(cosine * all));
}

}  // namespace deltalux::gather
