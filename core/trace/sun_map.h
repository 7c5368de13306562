// SPDX-License-Identifier: Apache-2.0
// Where the paths of a sun begin: more of them, each with less power, where they are of most use.
#pragma once
#include <cstddef>
#include <vector>

namespace deltalux::trace {

/// A sun's rectangle divided into squares of even density; chosen at the bake, see
/// plan/sun_guiding.h. Coordinates of the rectangle are in [0, 1).
struct SunMap {
  struct Leaf {
    float u, v, size;
    float below;  ///< chance of the leaves before it
  };
  struct Start {
    float u, v;
    float weight;  ///< of a path's power: chance if starts were spread evenly, over that here
  };
  static constexpr float kMinDensity = 0.25f;    ///< of an even one
  static constexpr size_t kMaxLeaves = 1 << 16;  ///< leaves

  /// `r`, `s`: random, in [0, 1); well spread ones stay so.
  Start start(float r, float s) const;
  float max_weight() const;
  /// Why starts can't follow it; null where they can.
  const char* flaw() const;

  std::vector<Leaf> leaves;

 private:
  float chance(size_t leaf) const {
    return (leaf + 1 < leaves.size() ? leaves[leaf + 1].below : 1.0f) - leaves[leaf].below;
  }
};

}  // namespace deltalux::trace
