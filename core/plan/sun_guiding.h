// SPDX-License-Identifier: Apache-2.0
// Guiding of a sun's paths: most of them end on the outside of a building. Pilot paths find the
// places on its rectangle where those paths start that bring light to dim places, especially
// through windows, so that more paths can start there.
#pragma once
#include <memory>
#include <span>

#include "plan/light_pilot.h"
#include "trace/sun_map.h"

namespace deltalux::plan {

/// Makes a map whose density is proportional to the root mean square of the paths' indirect
/// contributions, which minimises the variance. Returns null if uniform starts are about as good,
/// or if the sun shines on nothing.
///
/// `weight`: by point of the pilot. Throws Cancelled.
std::shared_ptr<const trace::SunMap> guide_sun(const LightPilot& pilot, const trace::Light& sun,
                                               std::span<const double> weight,
                                               const Workers& workers, Progress& progress);

}  // namespace deltalux::plan
