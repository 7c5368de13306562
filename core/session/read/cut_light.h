// SPDX-License-Identifier: Apache-2.0
// Light that is missing because paths end after Options::max_bounces segments.
#pragma once
#include "base/vec.h"
#include "session/state/state.h"

namespace deltalux::session {

/// The light that the ends of cut paths would have brought, relative to all light that lands, per
/// channel. It assumes that reflections go on as those at the last hits. 0 if no path was cut, or
/// if this session holds none. A pure function of the state.
Vec3d cut_share(const State& state);

}  // namespace deltalux::session
