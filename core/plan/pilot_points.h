// SPDX-License-Identifier: Apache-2.0
// Where pilots measure light: at what users look at, and at what sends light there. A house on wide
// land would get hardly any of points spread by area.
#pragma once
#include <cstdint>

#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::plan {

/// Points on the front sides of the static surfaces, with the `radius` of discs: half of them
/// distributed by area, half evenly over the triangles, since there are many where there is
/// something to see.
samples::SampleSet surface_points(const scene::Scene& scene, float radius, uint32_t count);
/// At most `count` points: some of the static `samples`, drawn at random; where rays from such
/// samples land; and some surface_points(), since users may ask elsewhere later (all of them, if no
/// sample is static). Only static geometry counts, and not the order of the samples. `metre`:
/// samples::scene_metre of the scene.
samples::SampleSet pilot_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                const samples::SampleSet& samples, float metre, uint32_t count);

}  // namespace deltalux::plan
