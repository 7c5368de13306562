// SPDX-License-Identifier: Apache-2.0
// Guiding of the paths of large area lights: of those of a luminous sky, most end on a site that
// nobody looks at. Short paths that are followed backwards find out where light comes from.
#pragma once
#include <memory>
#include <span>

#include "plan/light_pilot.h"
#include "trace/aim_map.h"

namespace deltalux::plan {

/// Whether the light is so large, as a room or more, that its paths may need to be aimed.
/// `metre`: samples::scene_metre of the scene.
bool may_be_aimed(const trace::Light& light, float metre);

/// Makes a map that aims at the places from which the light's paths reach the pilot's places.
/// Returns null if cosine-distributed paths are about as good.
///
/// `weight`: by point of the pilot. Throws Cancelled.
std::shared_ptr<const trace::AimMap> aim_light(const LightPilot& pilot, const trace::Light& light,
                                               std::span<const double> weight,
                                               const Workers& workers, Progress& progress);

}  // namespace deltalux::plan
