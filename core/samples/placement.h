// SPDX-License-Identifier: Apache-2.0
// Lengths that a scene does not specify: disc radii, which balance noise and blur, and the offset
// at which a sample's rays start. All depend on nearby geometry, never on the size of the whole
// scene: a room in a landscape is treated like the room alone.
#pragma once
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/sample_set.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

/// The scene metre: a length of about one metre in a room with a diagonal of ten metres, so that
/// the scene's unit does not matter. It is a share of the size of the space that short diffuse
/// walks explore, measured where the static scene has most detail (every triangle counts alike), on
/// the sides of triangles that face something.
float scene_metre(const scene::Scene& scene, const trace::RayCaster& caster);

/// Replaces NaN radii by clamp(0.8 H, 0.1 b, 0.2 b), in metres of the room around the sample (at
/// least scene_metre(), since niches are not rooms). b = (1e6 / paths)^(1/6); H is the harmonic
/// mean distance to static geometry over 16 rays of the hemisphere. Samples on movables get 0.1 b
/// scene_metre(), but at most half of the object's size. The result depends on the static scene,
/// the object's shape and the sample only.
void resolve_lengths(const scene::Scene& scene, const trace::RayCaster& caster, uint64_t paths,
                     const Workers& workers, Progress& progress, SampleSet& samples);

}  // namespace deltalux::samples
