// SPDX-License-Identifier: Apache-2.0
// Proves that surfaces hide a light completely, so that no rays need search for a gap.
#pragma once
#include <cstdint>
#include <span>

#include "direct/light_shape.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// Whether static geometry, the receiver's own object and `movables` together hide the whole light:
/// triangles that single rays find are taken away from the light's outline until next to nothing
/// is left of it. False also where that is not found out with few triangles.
bool is_covered(const trace::RayCaster& caster, const LightShape& light, const Receiver& receiver,
                std::span<const uint32_t> movables);

}  // namespace deltalux::direct
