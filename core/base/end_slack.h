// SPDX-License-Identifier: Apache-2.0
// Bound of the rounding errors at the end of a ray.
#pragma once
#include <algorithm>

#include "base/vec.h"

namespace deltalux {

/// position_slack() of the end of a ray at `p` that comes `way` along: rounding errors grow with
/// the distance, too, so that the slack does not vanish near the origin of coordinates.
inline float end_slack(Vec3f p, Vec3f way) {
  return std::max(position_slack(p), position_slack(way));
}

}  // namespace deltalux
