// SPDX-License-Identifier: Apache-2.0
// Where a chain goes on from a surface: anywhere, or towards a guide.
#pragma once
#include <array>

#include "gather/sample_rays.h"

namespace deltalux::gather {

/// Directions about a unit normal: cosine-distributed, or towards one of the guides by what it may
/// bring (at most half of them).
class Turn {
 public:
  Turn(const Guiding& guiding, const Beams& beams, Vec3f from, Vec3f n);
  /// `u`, `v`: random, in [0, 1). Sets `in_beam` where a beam's points decide.
  Aim draw(float u, float v, bool& in_beam) const;
  /// As of SampleRays.
  float weight(const Aim& aim, float t, const direct::Receiver& at, const trace::RayCaster& caster,
               bool& in_beam) const;

 private:
  std::span<const Guide> guides_;
  const Beams& beams_;
  Vec3f from_, normal_;
  std::array<float, kMostGuides + kMostBeams> share_;
  float all_ = 0, guided_ = 0;  // of the shares; chance of guides together
};

}  // namespace deltalux::gather
