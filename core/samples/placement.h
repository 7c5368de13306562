// SPDX-License-Identifier: Apache-2.0
// Automatic disc radii, balanced between noise and blur by a pilot of a few rays per sample.
#pragma once
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/sample_set.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

/// Length that is one metre in a room of about ten metres' diagonal; scales radii with the scene,
/// so that units do not matter.
float scene_metre(const scene::Scene& scene);

/// Replaces NaN radii by clamp(0.8 H, 0.08 b, 0.2 b) scene metres, b = (1e6 / paths)^(1/6), H the
/// harmonic mean distance to the static surroundings over 16 rays of the hemisphere. A sample's
/// radius depends on the static scene and on itself alone.
void resolve_radii(const scene::Scene& scene, const trace::RayCaster& caster, uint64_t paths,
                   const Workers& workers, Progress& progress, SampleSet& samples);

}  // namespace deltalux::samples
