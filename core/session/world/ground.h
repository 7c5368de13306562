// SPDX-License-Identifier: Apache-2.0
// What samples lie on: static geometry, or the object that carries them, alone.
#pragma once
#include <functional>
#include <vector>

#include "base/progress.h"
#include "samples/placement.h"
#include "session/world/world.h"

namespace deltalux::session {

/// Calls visit(object, its samples, scene, ground) for the static samples (object kNone), then for
/// those of each movable, with the scene of the ground alone.
void each_ground(const World& world, Progress& progress,
                 const std::function<void(uint32_t, std::vector<uint32_t>, const scene::Scene&,
                                          const samples::Ground&)>& visit);

}  // namespace deltalux::session
