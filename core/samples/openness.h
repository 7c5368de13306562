// SPDX-License-Identifier: Apache-2.0
// Openness: how much less of the room's light reaches a sample than the rest of its disc, due to
// nearby static geometry. In slits, under and behind objects, light falls off within a centimetre;
// a disc as large as the noise requires would blur that. Division by this ratio restores it.
#pragma once
#include <span>

#include "base/parallel.h"
#include "base/progress.h"
#include "samples/disc_set.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

constexpr float kMaxOpenness = 1e6f;  ///< far above what is ever found

/// Openness at `centre` relative to its mean over the disc within `outline`. Openness is the share
/// of light from uniformly bright surroundings, a few radii away, that reaches a point: found by
/// random walks, which reflections attenuate and which end in the surroundings or on an emitter. 1
/// where a sample is open, or where nothing reaches the disc at all. A pure function of the static
/// scene, the same for all methods.
float relative_openness(const scene::Scene& scene, const trace::RayCaster& caster, Vec3f centre,
                        Vec3f normal, float radius, const Outline& outline);

/// Computes the openness of those samples of `discs` that are at `first` or later but before
/// `last`, into `openness`, which has a place for each sample. The most expensive part of preparing
/// a bake if most samples are close to objects.
void find_openness(const DiscSet& discs, size_t first, size_t last, const scene::Scene& scene,
                   const trace::RayCaster& caster, const Workers& workers, Progress& progress,
                   std::span<float> openness);

}  // namespace deltalux::samples
