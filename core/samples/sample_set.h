// SPDX-License-Identifier: Apache-2.0
// Samples: where irradiance is computed. Each belongs to the static part or to one movable object,
// in whose local space its point and normal are given.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/scene.h"

namespace deltalux::samples {

/// How the area of a disc is determined.
enum class DiscArea : uint8_t {
  reachable,  ///< the part that the centre can reach in the tangent plane, see disc_area.h
  whole,      ///< the whole circle (the paper's plain rule)
};

struct SampleSet {
  std::vector<Vec3f> point, normal;  ///< normal of unit length
  std::vector<float> radius;         ///< disc radius; NaN = automatic, until resolve_lengths()
  std::vector<uint32_t> attached;    ///< movable object, or scene::kNone
  size_t size() const { return point.size(); }
  /// Returns a set whose sample i is sample order[i] of this one.
  SampleSet reordered(std::span<const uint32_t> order) const;
};

}  // namespace deltalux::samples
