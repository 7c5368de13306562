// SPDX-License-Identifier: Apache-2.0
// Most of a sun's paths end on the outside of a building. A pilot finds where on its rectangle
// those begin that bring light to dim places, through windows above all, and sends more of them.
#pragma once
#include <memory>
#include <span>

#include "plan/light_pilot.h"
#include "trace/sun_map.h"

namespace deltalux::plan {

/// A map whose density follows the root of the mean square of what paths bring indirectly, so that
/// their sum has the least variance. Null where even starts are about as good, and where the sun
/// shines on nothing.
///
/// `weight`: of the pilot's points. Throws Cancelled.
std::shared_ptr<const trace::SunMap> guide_sun(const LightPilot& pilot, const trace::Light& sun,
                                               std::span<const double> weight,
                                               const Workers& workers, Progress& progress);

}  // namespace deltalux::plan
