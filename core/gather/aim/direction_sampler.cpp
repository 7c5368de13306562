// SPDX-License-Identifier: Apache-2.0
// Draws one of the guides at random, and computes the density of a direction over all techniques.
#include "gather/aim/direction_sampler.h"

#include <algorithm>

#include "base/hemisphere.h"

namespace deltalux::gather {

namespace {

float stretched(float x) { return std::clamp(x, 0.0f, 0x1.fffffep-1f); }

}  // namespace

GuideColumns::GuideColumns(std::span<const Guide> all) : guides(all) {
  constexpr size_t kLanes = 16;
  padded = (guides.size() + kLanes - 1) / kLanes * kLanes;
  for (size_t g = 0; g < guides.size(); ++g) {
    squares.set(g, guides[g]);
    brought[g] = guides[g].radiosity / guides[g].around;
  }
}

DirectionSampler::DirectionSampler(const GuideColumns& guides, const Beams& beams, Vec3f from,
                                   Vec3f n)
    : columns_(guides), guides_(guides.guides), beams_(beams), from_(from), normal_(n) {
  const GuideSquares<kMaxGuides>& at = guides.squares;
  alignas(64) std::array<float, kMaxGuides> share;
  for (size_t g = 0; g < guides.padded; ++g)
    share[g] = guides.brought[g] * share_of_view({at.x[g], at.y[g], at.z[g]},
                                                 {at.normal_x[g], at.normal_y[g], at.normal_z[g]},
                                                 at.half[g], from, n);
  size_t count = 0;
  float all = 0;
  const auto add = [&](size_t which, float own) {
    which_[count] = uint16_t(which), share_[count] = own;
    const bool brings = own > 0;
    all += brings ? own : 0.0f, count += brings;
  };
  for (size_t g = 0; g < guides_.size(); ++g) add(g, share[g]);
  for (size_t b = 0; b < beams_.size(); ++b) add(guides_.size() + b, beams_[b].share(from, n));
  count_ = count, all_ = all;
  if (all_ > 0) guided_ = all_ / std::max(2 * all_, all_ + 1);
}

Aim DirectionSampler::draw(float u, float v, bool& in_beam) const {
  // Reuse the random number of the choice: rescaled within its interval, it is uniform again.
  if (u >= guided_) return {cosine_direction(normal_, stretched((u - guided_) / (1 - guided_)), v)};
  float left = u / guided_ * all_;
  size_t last = 0;
  for (size_t i = 0; i < count_ && left >= 0; ++i) last = i, left -= share_[i];
  u = stretched((left + share_[last]) / share_[last]);
  const size_t chosen = which_[last];
  Aim aim;
  aim.guide = uint32_t(chosen);
  if (chosen < guides_.size()) {
    aim.w = Target(guides_[chosen], from_).direction(u, v);
  } else {
    in_beam = true;
    aim.point = &beams_[chosen - guides_.size()].point(Beam::number(u, v));
    aim.w = aim.point->seen_from(from_);
  }
  if (!(dot(aim.w, normal_) > 0)) aim.w = {};
  return aim;
}

float DirectionSampler::weight(const Aim& aim, float t, const direct::Receiver& at,
                               const trace::RayCaster& caster, bool& in_beam) const {
  if (!(guided_ > 0)) return 1;
  const float cosine = dot(aim.w, normal_);
  if (!(cosine > 0)) return 0;
  const bool by_guide = aim.guide != scene::kNone;
  PowerHeuristic heuristic(double(cosine * (1 - guided_)), !by_guide);
  alignas(64) std::array<float, kMaxGuides> may;
  columns_.squares.may_meet(from_, aim.w, columns_.padded, may);
  for (size_t i = 0; i < count_; ++i) {
    const size_t g = which_[i];
    if (g < guides_.size() && !(may[g] > 0) && g != aim.guide) continue;
    const float density = g < guides_.size()
                              ? Target(guides_[g], from_).density(aim.w)
                              : beams_[g - guides_.size()].density(aim.w, t, at, caster, in_beam);
    heuristic.add(double(share_[i] * (guided_ / all_)) * double(density), g == aim.guide);
  }
  return heuristic.weight(double(cosine));
}

}  // namespace deltalux::gather
