// SPDX-License-Identifier: Apache-2.0
// One of the guides by chance, and what all of them together make of a direction's chance.
#include "gather/turn.h"

#include <algorithm>

#include "trace/scatter.h"

namespace deltalux::gather {

namespace {

float stretched(float x) { return std::clamp(x, 0.0f, 0x1.fffffep-1f); }

}  // namespace

Turn::Turn(const Guiding& guiding, const Beams& beams, Vec3f from, Vec3f n)
    : guides_(guiding.guides), beams_(beams), from_(from), normal_(n) {
  for (size_t g = 0; g < guides_.size(); ++g)
    all_ += share_[g] =
        guides_[g].radiosity / guides_[g].around * share_of_view(guides_[g], from, n);
  for (size_t b = 0; b < beams_.size(); ++b)
    all_ += share_[guides_.size() + b] = beams_[b].share(from, n);
  if (all_ > 0) guided_ = all_ / std::max(2 * all_, all_ + 1);
}

Aim Turn::draw(float u, float v, bool& in_beam) const {
  // What chose is used again: stretched over its interval it is as random.
  if (u >= guided_)
    return {trace::cosine_direction(normal_, stretched((u - guided_) / (1 - guided_)), v)};
  float left = u / guided_ * all_;
  size_t chosen = 0;
  for (size_t g = 0; g < guides_.size() + beams_.size() && left >= 0; ++g)
    if (share_[g] > 0) chosen = g, left -= share_[g];
  u = stretched((left + share_[chosen]) / share_[chosen]);
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

float Turn::weight(const Aim& aim, float t, const direct::Receiver& at,
                   const trace::RayCaster& caster, bool& in_beam) const {
  if (!(guided_ > 0)) return 1;
  const float cosine = dot(aim.w, normal_);
  if (!(cosine > 0)) return 0;
  const bool by_guide = aim.guide != scene::kNone;
  PowerHeuristic heuristic(double(cosine * (1 - guided_)), !by_guide);
  for (size_t g = 0; g < guides_.size() + beams_.size(); ++g) {
    if (!(share_[g] > 0)) continue;
    const float density = g < guides_.size()
                              ? Target(guides_[g], from_).density(aim.w)
                              : beams_[g - guides_.size()].density(aim.w, t, at, caster, in_beam);
    heuristic.add(double(share_[g] * (guided_ / all_)) * double(density), g == aim.guide);
  }
  return heuristic.weight(double(cosine));
}

}  // namespace deltalux::gather
