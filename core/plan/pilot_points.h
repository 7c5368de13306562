// SPDX-License-Identifier: Apache-2.0
// Where pilots measure light: at what users look at, and at what sends light there. A house on wide
// land would get hardly any of points spread by area.
#pragma once
#include <cstdint>

#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::plan {

/// Points distributed by area over the front sides of the static surfaces, with radii of discs.
samples::SampleSet surface_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                  uint32_t count);
/// `count` points: some of the static `samples`, spread evenly over their order; where rays from
/// samples land; and some surface_points(), since users may ask elsewhere later (all of them, if no
/// sample is static). Only static geometry counts.
samples::SampleSet pilot_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                const samples::SampleSet& samples, uint32_t count);

}  // namespace deltalux::plan
