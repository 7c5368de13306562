// SPDX-License-Identifier: Apache-2.0
// Direct light of many receivers whose result is not kept, such as the pixels of an image:
// important lights get more shadow rays.
#pragma once
#include <span>

#include "base/parallel.h"
#include "base/progress.h"
#include "direct/direct_light.h"

namespace deltalux::direct {

/// Irradiance at each receiver from all of `present.lights`, with dimming by `dim` (per light). A
/// light that contributes more than a quarter of the estimated total is sampled as in DirectLight;
/// others with 36 rays, those below one per cent with 12. A pure function of place and scene.
/// Throws Cancelled.
void light_by_need(const Context& context, std::span<const double> dim, uint64_t seed,
                   const Workers& workers, Progress& progress, std::span<Vec3d> irradiance);

}  // namespace deltalux::direct
