// SPDX-License-Identifier: Apache-2.0
// Samples: where irradiance is asked. Each belongs to the static part or to one movable object, in
// whose own space its point and normal are given.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "scene/scene.h"

namespace deltalux::samples {

/// How a disc's area is counted.
enum class DiscArea : uint8_t {
  reachable,  ///< the part that the centre reaches in the tangent plane, see disc_area.h
  whole,      ///< the whole circle (the paper's plain rule)
};

struct SampleSet {
  std::vector<Vec3f> point, normal;  ///< normal of unit length
  std::vector<float> radius;         ///< disc radius; NaN = automatic, until resolved
  std::vector<uint32_t> attached;    ///< movable object, or scene::kNone
  size_t size() const { return point.size(); }
  /// Sample i of the result is sample order[i] of this set.
  SampleSet reordered(std::span<const uint32_t> order) const;
};

}  // namespace deltalux::samples
