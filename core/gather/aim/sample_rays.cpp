// SPDX-License-Identifier: Apache-2.0
// Decides where each ray of a sample goes.
#include "gather/aim/sample_rays.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace deltalux::gather {
namespace {

// Share of a sample's irradiance: guides whose noise is lower are ignored.
constexpr float kWorth = 0.01f;
// weight of all other light beside guides, relative to a sample's irradiance
constexpr float kRest = 0.25f;
constexpr float kMaxShare = 1e20f;  // larger shares are not finite
constexpr size_t kMaxAsked = 32;    // guides that a sample tests for visibility, the noisiest first
constexpr uint32_t kTries = 8;      // rays that test how much of a guide is visible
// if none of those sees it: even through a slit a guide can be bright
constexpr uint32_t kMaxTries = 64;
constexpr uint32_t kAllLooks = 512;  // per sample, approximately

/// A guide or beam that a sample may cast rays to.
struct Candidate {
  float noise, share;  ///< if all of it were visible
  uint16_t guide;
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

/// Casts visibility rays from a place to points of guides; rays that nothing static blocks count as
/// hits.
class SightLines {
 public:
  SightLines(const trace::RayCaster& caster, Vec3f from) : caster_(caster) { fan_.origin = from; }
  /// Adds a ray to the point at offset `d`.
  void add(Vec3f d, Candidate& candidate) {
    if (fan_.count == trace::RayFan::kMaxRays) cast();
    fan_.x[fan_.count] = d.x, fan_.y[fan_.count] = d.y, fan_.z[fan_.count] = d.z;
    owner_[fan_.count++] = &candidate;
  }
  void cast() {
    trace::RayBits all{};
    for (size_t i = 0; i < fan_.count; ++i) all[i / 64] |= uint64_t(1) << (i % 64);
    const trace::RayBits blocked = caster_.occluded_static(fan_, all);
    for (size_t i = 0; i < fan_.count; ++i) owner_[i]->hits += !(blocked[i / 64] >> (i % 64) & 1);
    fan_.count = 0;
  }

 private:
  const trace::RayCaster& caster_;
  trace::RayFan fan_;
  std::array<Candidate*, trace::RayFan::kMaxRays> owner_;
};

}  // namespace

SeenGuides see_guides(std::span<const Guide> guides, const Beams& beams,
                      const direct::Receiver& receiver, uint32_t rays,
                      const trace::RayCaster& caster, uint64_t seed) {
  SeenGuides out;
  if (receiver.normal == Vec3f{}) return out;
  const Vec3f origin = receiver.point + receiver.normal * receiver.slack();
  std::vector<Candidate> candidates;
  const auto consider = [&](float square, float irradiance, float around, size_t guide) {
    const float noise = std::sqrt(square / float(rays)) / around;
    const float share = irradiance / around;
    if (noise > kWorth)
      candidates.push_back({noise, share < kMaxShare ? share : kMaxShare, uint16_t(guide)});
  };
  for (size_t g = 0; g < guides.size(); ++g) {
    const Guide& guide = guides[g];
    const float seen = share_of_view(guide, origin, receiver.normal);
    consider(guide.brightest * guide.brightest * seen, guide.radiosity * seen, guide.around, g);
  }
  for (size_t b = 0; b < beams.size(); ++b) {
    const Beam::Brought brought = beams[b].brought(origin, receiver.normal);
    const float peak = beams[b].brightest();
    consider(brought.square + peak * brought.perhaps, brought.irradiance + brought.perhaps,
             beams[b].guide().around, RayAllotment::kFirstBeam + b);
  }
  SightLines lines(caster, origin);
  keep_seen(candidates, [&](std::span<Candidate* const> asked) {
    for (Candidate* own : asked) {
      const PathRandom random(combine(seed, receiver.key), own->guide);
      for (const uint32_t end = own->tries + kTries; own->tries < end; ++own->tries) {
        const uint32_t k = own->tries;
        if (own->guide >= guides.size()) {
          const Beam& beam = beams[own->guide - RayAllotment::kFirstBeam];
          own->hits += beam.sees(k, caster, origin, receiver.normal, random);
          continue;
        }
        const Guide& guide = guides[own->guide];
        const Vec3f w = Target(guide, origin).direction(random(k, 0), random(k, 1));
        if (!(dot(w, receiver.normal) > 0)) continue;
        // Shorten the ray to where it comes close to the guide's plane.
        const float along = dot(w, guide.normal);
        const float near = std::fabs(dot(guide.centre - origin, guide.normal)) - guide.rise;
        lines.add(w * (std::max(near, 0.0f) / std::fabs(along)), *own);
      }
    }
    lines.cast();
  });
  for (const Candidate& candidate : candidates)
    if (candidate.share > 0) out.each[out.count++] = {candidate.share, candidate.guide};
  return out;
}

RayAllotment allot_rays(const SeenGuides& seen, uint32_t rays) {
  RayAllotment out;
  float all = 0;
  for (uint32_t i = 0; i < seen.count; ++i) all += seen.each[i].share;
  // One ray per part for each guide, the rest in proportion to the guides' light; at least half of
  // all rays stay cosine-distributed.
  const uint32_t most = rays / (2 * kParts);
  const float more = float(most - std::min(most, seen.count));
  uint32_t left = most;
  for (uint32_t i = 0; i < seen.count && left > 0; ++i) {
    const SeenGuides::Seen& own = seen.each[i];
    const uint32_t eighths = std::min(left, 1 + uint32_t(more * own.share / (all + kRest)));
    out.guide[i] = own.guide;
    out.eighth[i] = uint16_t(eighths);
    left -= eighths;
  }
  return out;
}

SampleRays::SampleRays(const Directions& directions, const Guiding& guiding, const Beams& beams,
                       uint32_t sample, uint32_t rays, const direct::Receiver& receiver)
    : directions_(directions),
      key_(receiver.key),
      count_(rays),
      origin_(receiver.point + receiver.normal * receiver.slack()),
      normal_(receiver.normal) {
  if (guiding.allotments.empty()) return;
  allotment_ = guiding.allotments[sample];
  guided_ = allotment_.guided();
  for (uint32_t slot = 0; slot < kMaxUsed; ++slot) {
    if (!allotment_.eighth[slot]) continue;
    const uint32_t guide = allotment_.guide[slot];
    if (guide < RayAllotment::kFirstBeam) {
      targets_[slot] = Target(guiding.guides[guide], origin_);
      squares_.set(slot, guiding.guides[guide]);
    } else {
      beam_[slot] = &beams[guide - RayAllotment::kFirstBeam];
    }
  }
}

uint32_t SampleRays::ray_of_even(uint32_t number) const {
  uint32_t part = 0;
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
  Aim aim;
  if (beam_[slot]) {
    aim.point = &beam_[slot]->point(point_of(slot, number));
    aim.w = aim.point->seen_from(origin_);
  } else {
    const auto [u, v] = directions_.point(key_, slot + 1, number);
    aim.w = targets_[slot].direction(u, v);
  }
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
  squares_.may_meet(origin_, w, kMaxUsed, may);
  for (uint32_t slot = 0; slot < kMaxUsed; ++slot) {
    if (!allotment_.eighth[slot]) continue;
    if (!beam_[slot] && !(may[slot] > 0) && slot != own_slot) continue;
    const float density =
        beam_[slot] ? beam_[slot]->density(w, t, at, caster, in_beam) : targets_[slot].density(w);
    heuristic.add(double(kParts * allotment_.eighth[slot]) * double(density), slot == own_slot);
  }
  return heuristic.weight(double(cosine * all));
}

}  // namespace deltalux::gather
