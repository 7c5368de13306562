// SPDX-License-Identifier: Apache-2.0
// Resolves what is visible of a light where its 256 fine strata are too few: divides those at the
// edge of what is visible, in two levels.
#pragma once
#include <functional>

#include "direct/visibility.h"

namespace deltalux::direct {

/// Of some rays, those that nothing blocks.
using FreeRays = std::function<trace::RayBits(const Strata&)>;

/// Whether the error is so large that more rays should be cast.
bool is_rough(const Seen& seen);

/// The share by the fine strata of which `free` (a subset of the countable) are visible. Its error
/// is that of the strata at the edge of what is visible: jittered points in strata that are
/// completely visible or hidden have none.
Seen by_strata(const Strata& fine, const trace::RayBits& free);

/// Divides the strata beside which visibility changes, then those beside what has turned out to be
/// partly visible, and so on: up to kFineRays * kParts * kParts rays. If little is visible,
/// divides all strata; and if that is still rough, their parts in the same way.
Seen refine(const LightShape& light, const Receiver& receiver, const Strata& fine,
            const trace::RayBits& free, const FreeRays& free_rays);

}  // namespace deltalux::direct
