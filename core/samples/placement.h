// SPDX-License-Identifier: Apache-2.0
// Lengths that a scene does not give: disc radii, balanced between noise and blur, and how far off
// its surface a sample's rays begin. All follow what is near, never the whole scene's size: a room
// in a landscape is treated as the room alone.
#pragma once
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/sample_set.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

/// Length that is about one metre in a room of ten metres' diagonal, so that units do not matter:
/// a share of the size of what short diffuse walks meet. Of the static scene where it has most
/// detail (each triangle counts alike), on the sides that face something.
float scene_metre(const scene::Scene& scene, const trace::RayCaster& caster);

/// Replaces NaN radii by clamp(0.8 H, 0.1 b, 0.2 b) metres of the room around the sample (no less
/// than scene_metre(): niches are no rooms), b = (1e6 / paths)^(1/6), H the harmonic mean distance
/// to the static surroundings over 16 rays of the hemisphere. Samples on movables get 0.1 b
/// scene_metre(), but no more than half the object's size. All depends on the static scene, the
/// object's shape and the sample alone.
void resolve_lengths(const scene::Scene& scene, const trace::RayCaster& caster, uint64_t paths,
                     const Workers& workers, Progress& progress, SampleSet& samples);

}  // namespace deltalux::samples
