// SPDX-License-Identifier: Apache-2.0
// Discs of samples as a structure of arrays, with outlines of clipped discs.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace deltalux::samples {

/// The part of a disc that its centre can reach in the tangent plane: a star-shaped polygon through
/// kProbes points at equal angles in tangent_frame(normal), at distances radius[k] in metres.
/// Between two unclipped neighbours, the outline follows the circle.
inline constexpr int kProbes = 32;
using Outline = std::array<float, kProbes>;
inline constexpr uint32_t kWholeDisc = 0xffffffffu;

/// All arrays have the same length. `id` is the index of the sample whose sums the disc adds to.
struct DiscSet {
  std::vector<Vec3f> centre, normal;
  std::vector<float> radius;
  std::vector<uint32_t> outline;  ///< index into `outlines`, or kWholeDisc
  std::vector<uint32_t> id;
  std::vector<Outline> outlines;
  size_t size() const { return centre.size(); }
  size_t bytes() const {
    return size() * (2 * sizeof(Vec3f) + sizeof(float) + 2 * sizeof(uint32_t)) +
           outlines.size() * sizeof(Outline);
  }
};

}  // namespace deltalux::samples
