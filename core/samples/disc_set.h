// SPDX-License-Identifier: Apache-2.0
// Discs of samples as structure of arrays, with the outline of those that are clipped.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "base/vec.h"

namespace deltalux::samples {

/// The part of a disc that its centre reaches in the tangent plane: a star polygon through
/// kProbes points at equal angles in tangent_frame(normal), radius[k] in metres. Between two
/// unclipped neighbours the outline is the circle.
inline constexpr int kProbes = 32;
using Outline = std::array<float, kProbes>;
inline constexpr uint32_t kWholeDisc = 0xffffffffu;

/// All arrays have the same length. `id` is the sample whose sums the disc feeds.
struct DiscSet {
  std::vector<Vec3f> centre, normal;
  std::vector<float> radius;
  std::vector<uint32_t> outline;  ///< index into `outlines`, or kWholeDisc
  std::vector<uint32_t> id;
  std::vector<float>
      openness;  ///< at the centre over that of the disc; 1 until it is found (openness.h)
  std::vector<float> slack;  ///< Scene::slack_of the surface under the sample
  std::vector<Outline> outlines;
  size_t size() const { return centre.size(); }
  size_t bytes() const {
    return size() * (2 * sizeof(Vec3f) + sizeof(float) + 2 * sizeof(uint32_t)) +
           (openness.size() + slack.size()) * sizeof(float) + outlines.size() * sizeof(Outline);
  }
};

}  // namespace deltalux::samples
