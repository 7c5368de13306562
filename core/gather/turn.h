// SPDX-License-Identifier: Apache-2.0
// Where a chain goes on from a surface: anywhere, or towards a guide.
#pragma once
#include <array>

#include "gather/sample_rays.h"

namespace deltalux::gather {

/// What Turn reads of every guide.
struct GuideColumns {
  explicit GuideColumns(std::span<const Guide> guides);

  std::span<const Guide> guides;
  size_t padded =
      0;  ///< a multiple of the lanes of a vector; those beyond the guides bring nothing
  GuideSquares<kMaxGuides> squares;
  alignas(64) std::array<float, kMaxGuides> brought{};  ///< if it filled the view
};

/// Directions about a unit normal: cosine-distributed, or towards one of the guides by what it may
/// bring (at most half of them).
class Turn {
 public:
  Turn(const GuideColumns& guides, const Beams& beams, Vec3f from, Vec3f n);
  /// `u`, `v`: random, in [0, 1). Sets `in_beam` where a beam's points decide.
  Aim draw(float u, float v, bool& in_beam) const;
  /// As of SampleRays.
  float weight(const Aim& aim, float t, const direct::Receiver& at, const trace::RayCaster& caster,
               bool& in_beam) const;

 private:
  const GuideColumns& columns_;
  std::span<const Guide> guides_;
  const Beams& beams_;
  Vec3f from_, normal_;
  size_t count_ = 0;  // of those that bring something
  std::array<uint16_t, kMaxGuides + kMaxBeams> which_;
  std::array<float, kMaxGuides + kMaxBeams> share_;
  float all_ = 0, guided_ = 0;  // of the shares; chance of guides together
};

}  // namespace deltalux::gather
