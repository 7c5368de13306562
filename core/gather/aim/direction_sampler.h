// SPDX-License-Identifier: Apache-2.0
// The direction in which a chain continues from a surface: cosine-distributed, or towards a guide.
#pragma once
#include <array>

#include "gather/aim/sample_rays.h"

namespace deltalux::gather {

/// Data of all guides that DirectionSampler reads, as a structure of arrays.
struct GuideColumns {
  explicit GuideColumns(std::span<const Guide> guides);

  std::span<const Guide> guides;
  size_t padded =
      0;  ///< a multiple of the lanes of a vector; those beyond the guides bring nothing
  GuideSquares<kMaxGuides> squares;
  /// irradiance if the guide filled the view, relative to its surroundings
  alignas(64) std::array<float, kMaxGuides> brought{};
};

/// Draws directions about a unit normal: cosine-distributed, or towards one of the guides in
/// proportion to the light that it may bring (with a probability of at most one half).
class DirectionSampler {
 public:
  /// `guides` and `beams` must outlive it.
  DirectionSampler(const GuideColumns& guides, const Beams& beams, Vec3f from, Vec3f n);
  DirectionSampler(GuideColumns&&, const Beams&, Vec3f, Vec3f) = delete;
  /// `u`, `v`: random, in [0, 1). Sets `in_beam` if the direction depends on a beam's points.
  Aim draw(float u, float v, bool& in_beam) const;
  /// The same as SampleRays::weight().
  float weight(const Aim& aim, float t, const direct::Receiver& at, const trace::RayCaster& caster,
               bool& in_beam) const;

 private:
  const GuideColumns& columns_;
  std::span<const Guide> guides_;
  const Beams& beams_;
  Vec3f from_, normal_;
  size_t count_ = 0;  // guides that bring something
  std::array<uint16_t, kMaxGuides + kMaxBeams> which_;
  std::array<float, kMaxGuides + kMaxBeams> share_;
  float all_ = 0, guided_ = 0;  // the sum of the shares; the probability of drawing a guide
};

}  // namespace deltalux::gather
