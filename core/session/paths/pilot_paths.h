// SPDX-License-Identifier: Apache-2.0
// A few of a session's paths, walked before the bake but not stored: the basis of forecasts.
#pragma once
#include <vector>

#include "base/progress.h"
#include "session/world/world.h"

namespace deltalux::session {

/// One segment of a pilot path.
struct PilotFlight {
  Vec3f origin, direction;
  float length = 0, extended = 0;
  uint32_t light = 0, primitive = scene::kNone;
  uint32_t bounce = 0;  ///< 0: the first segment of a path
};

struct PilotPaths {
  std::vector<PilotFlight> flights;  ///< path by path
  uint64_t walked = 0;               ///< number of pilot paths
  uint64_t all = 0;                  ///< number of all paths
  uint64_t held = 0;                 ///< number of those that the session holds
  uint32_t deepest = 0;              ///< highest bounce

  /// How many of the session's segments one pilot segment represents.
  double weight() const { return walked ? double(held) / double(walked) : 0.0; }
};

/// Walks every k-th path of each light, about 8192 in all, whoever holds them, so that forecasts do
/// not depend on the session's range. Throws Cancelled.
PilotPaths walk_pilot_paths(const World& world, Progress& progress);

}  // namespace deltalux::session
