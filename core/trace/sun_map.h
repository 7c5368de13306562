// SPDX-License-Identifier: Apache-2.0
// Where the paths of a sun start: more paths, with less power each, where they are most useful.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

namespace deltalux::trace {

/// A sun's rectangle, divided into squares of uniform density; chosen at the bake, see
/// plan/sun_guiding.h. Coordinates within the rectangle are in [0, 1).
struct SunMap {
  struct Leaf {
    float u, v, size;
    float below;  ///< cumulative probability of the leaves before it
  };
  struct Start {
    float u, v;
    float weight;  ///< of the path's power: density of uniform starts over the density here
  };
  static constexpr float kMinDensity = 0.25f;  ///< relative to the uniform density
  /// Random numbers are multiples of one over this, and so are the leaves' chances.
  static constexpr uint32_t kSteps = 1 << 24;
  static constexpr size_t kMaxLeaves = 1 << 16;  ///< leaves

  /// `r`, `s`: random, in [0, 1). Preserves stratification.
  Start start(float r, float s) const;
  float max_weight() const;
  /// Why these data are invalid; null if they are valid.
  const char* flaw() const;

  std::vector<Leaf> leaves;

 private:
  float chance(size_t leaf) const {
    return (leaf + 1 < leaves.size() ? leaves[leaf + 1].below : 1.0f) - leaves[leaf].below;
  }
};

}  // namespace deltalux::trace
