// SPDX-License-Identifier: Apache-2.0
// Draws one of the targets at random, and computes the density of a direction over all techniques.
#include "gather/aim/direction_sampler.h"

#include <algorithm>

#include "base/hemisphere.h"

namespace deltalux::gather {

namespace {

float stretched(float x) { return std::clamp(x, 0.0f, 0x1.fffffep-1f); }

}  // namespace

DirectionSampler::DirectionSampler(const Targets& targets, Vec3f from, Vec3f n)
    : targets_(targets), from_(from), normal_(n) {
  alignas(64) Targets::Values share;
  targets.shares(from, n, share);
  size_t count = 0;
  float all = 0;
  for (size_t i = 0; i < targets.size(); ++i) {
    which_[count] = uint16_t(i), share_[count] = share[i];
    const bool brings = share[i] > 0;
    all += brings ? share[i] : 0.0f, count += brings;
  }
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
  Aim aim = targets_[which_[last]].aim(from_, u, v);
  aim.target = which_[last];
  in_beam |= aim.point != nullptr;
  if (!(dot(aim.w, normal_) > 0)) aim.w = {};
  return aim;
}

float DirectionSampler::weight(const Aim& aim, float t, const direct::Receiver& at,
                               const trace::RayCaster& caster, bool& in_beam) const {
  if (!(guided_ > 0)) return 1;
  const float cosine = dot(aim.w, normal_);
  if (!(cosine > 0)) return 0;
  PowerHeuristic heuristic(double(cosine * (1 - guided_)), aim.target == scene::kNone);
  alignas(64) Targets::Values may;
  targets_.may_be_dense(from_, aim.w, may);
  const LandedRay ray{from_, aim.w, t, at, caster};
  for (size_t i = 0; i < count_; ++i) {
    const size_t which = which_[i];
    if (!(may[which] > 0) && which != aim.target) continue;
    const float density = targets_[which].density(ray, in_beam);
    heuristic.add(double(share_[i] * (guided_ / all_)) * double(density), which == aim.target);
  }
  return heuristic.weight(double(cosine));
}

}  // namespace deltalux::gather
