// SPDX-License-Identifier: Apache-2.0
// Draws path starts by the probabilities of leaves.
#include "trace/sun_map.h"

#include <algorithm>
#include <cmath>

namespace deltalux::trace {

SunMap::Start SunMap::start(float r, float s) const {
  const auto above = std::upper_bound(leaves.begin() + 1, leaves.end(), r,
                                      [](float at, const Leaf& leaf) { return at < leaf.below; });
  const size_t i = size_t(above - leaves.begin()) - 1;
  const Leaf& leaf = leaves[i];
  const float wide = chance(i);
  const float within = std::clamp((r - leaf.below) / wide, 0.0f, 0x1.fffffep-1f);
  return {leaf.u + leaf.size * within, leaf.v + leaf.size * s, leaf.size * leaf.size / wide};
}

float SunMap::max_weight() const {
  float most = 0;
  for (size_t i = 0; i < leaves.size(); ++i)
    most = std::max(most, leaves[i].size * leaves[i].size / chance(i));
  return most;
}

const char* SunMap::flaw() const {
  if (leaves.empty() || leaves.size() > kMaxLeaves) return "a number of leaves that no map has";
  double area = 0;
  for (size_t i = 0; i < leaves.size(); ++i) {
    const Leaf& leaf = leaves[i];
    if (!(leaf.size > 0 && leaf.u >= 0 && leaf.v >= 0 && leaf.u + leaf.size <= 1 &&
          leaf.v + leaf.size <= 1))
      return "a leaf beyond its rectangle";
    if (!(leaf.below >= 0 && leaf.below < 1) || !(chance(i) > 0))
      return "chances that do not grow from 0 to 1";
    area += double(leaf.size) * double(leaf.size);
  }
  if (leaves.front().below != 0) return "chances that do not grow from 0 to 1";
  if (!(std::fabs(area - 1) < 1e-9)) return "leaves that do not fill their rectangle";
  // A factor of 2 leaves room for rounding of small probabilities.
  if (!(max_weight() < 2 / kMinDensity)) return "a leaf that gets hardly any paths";
  return nullptr;
}

}  // namespace deltalux::trace
