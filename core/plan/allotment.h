// SPDX-License-Identifier: Apache-2.0
// Decides how many paths each light gets. By power alone, a sun that shines on the outside of a
// closed room would get nearly all of them. Instead, pilot paths measure each light's indirect
// contribution to surfaces, and paths are allotted to minimise the relative error.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"

namespace deltalux::plan {

/// Returns the share of the paths for each light, and gives suns their maps. A sample's variance is
/// the sum over lights of power per path times irradiance, so the mean relative variance is minimal
/// for N ~ sqrt(power * sum E_light / E^2), here for indirect light (direct light comes from shadow
/// rays) over pilot_points() of these samples. Pilot paths only see static geometry, and lights
/// that move count as average ones of their power, since shares must not depend on the poses of
/// movables. Throws Cancelled.
std::vector<double> shares_by_use(const scene::Scene& scene, const trace::RayCaster& caster,
                                  const samples::SampleSet& samples, std::span<trace::Light> lights,
                                  const Workers& workers, Progress& progress);

}  // namespace deltalux::plan
