// SPDX-License-Identifier: Apache-2.0
// How much less of the room's light gets to a sample than to the rest of its disc, from nearby
// static geometry alone. In slits, under things and behind them, light falls off within a
// centimetre, and a disc as large as noise asks for blurs it away; the ratio puts it back.
#pragma once
#include "base/parallel.h"
#include "base/progress.h"
#include "samples/disc_set.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::samples {

/// Openness at `centre` over its mean over the disc within `outline`. Openness is the share of a
/// uniform bright surrounding, a few radii away, that arrives at a point: by walks that reflections
/// weaken and that end in the surrounding or on something that emits. 1 where a sample is open, or
/// nothing gets to the disc at all. A pure function of the static scene, the same for all methods.
float relative_openness(const scene::Scene& scene, const trace::RayCaster& caster, Vec3f centre,
                        Vec3f normal, float radius, const Outline& outline);

/// Fills in `discs.openness`; the longest part of preparing a bake where most samples lie beside
/// something.
void find_openness(DiscSet& discs, const scene::Scene& scene, const trace::RayCaster& caster,
                   const Workers& workers, Progress& progress);

}  // namespace deltalux::samples
