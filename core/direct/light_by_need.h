// SPDX-License-Identifier: Apache-2.0
// Direct light of many receivers that nobody keeps, as the pixels of a picture: shadow rays where a
// lamp brings much.
#pragma once
#include <span>

#include "base/parallel.h"
#include "base/progress.h"
#include "direct/direct_light.h"

namespace deltalux::direct {

/// Irradiance of each receiver by all of `present.lights`, dimmed by `dim` (per light). A lamp that
/// brings a quarter or more of what may still come is looked at as DirectLight does; lesser ones
/// with 36 rays, the least with 12. A pure function of place and scene. Throws Cancelled.
void light_by_need(const Present& present, std::span<const double> dim, uint64_t seed,
                   const Workers& workers, Progress& progress, std::span<Vec3d> irradiance);

}  // namespace deltalux::direct
