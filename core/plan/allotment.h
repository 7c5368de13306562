// SPDX-License-Identifier: Apache-2.0
// How many paths each light gets. By power alone, a sun that shines on the outside of a closed room
// would take nearly all of them. So a pilot measures what each light gives to surfaces indirectly,
// and paths go where they lower the relative error most.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::plan {

/// Shares of the paths, one per light; suns get their maps. A sample's variance is the sum over
/// lights of power per path times irradiance, so the mean relative variance is least for N ~
/// sqrt(power * sum E_light / E^2), here of indirect light (direct light is found by shadow rays)
/// over points spread evenly on the static surfaces. The pilot sees static geometry and
/// `reflectance` (per material) alone: shares must not depend on where movables stand; lights that
/// move count as average ones of their power. Throws Cancelled.
std::vector<double> shares_by_use(const scene::Scene& scene, std::span<const Vec3f> reflectance,
                                  const trace::RayCaster& caster, std::span<trace::Light> lights,
                                  const Workers& workers, Progress& progress);

}  // namespace deltalux::plan
