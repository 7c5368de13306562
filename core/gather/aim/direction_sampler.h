// SPDX-License-Identifier: Apache-2.0
// The direction in which a chain continues from a surface: cosine-distributed, or towards a target.
#pragma once
#include <array>

#include "gather/aim/sample_rays.h"

namespace deltalux::gather {

/// Draws directions about a unit normal: cosine-distributed, or towards one of the targets in
/// proportion to the light that it may bring (with a probability of at most one half).
class DirectionSampler {
 public:
  /// `targets` must outlive it.
  DirectionSampler(const Targets& targets, Vec3f from, Vec3f n);
  /// `u`, `v`: random, in [0, 1). Sets `in_beam` if the direction depends on a beam's points.
  Aim draw(float u, float v, bool& in_beam) const;
  /// The same as SampleRays::weight().
  float weight(const Aim& aim, float t, const direct::Receiver& at, const trace::RayCaster& caster,
               bool& in_beam) const;

 private:
  const Targets& targets_;
  Vec3f from_, normal_;
  size_t count_ = 0;  // targets that bring something
  std::array<uint16_t, kMaxTargets> which_;
  std::array<float, kMaxTargets> share_;
  float all_ = 0, guided_ = 0;  // the sum of the shares; the probability of drawing a target
};

}  // namespace deltalux::gather
