// SPDX-License-Identifier: Apache-2.0
// Receivers at any places of a scene as it is: which object they belong to, how precisely they lie
// on it.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "direct/light_shape.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// On the surface that is closer than `within` (metres) to each point, if there is one.
std::vector<Receiver> receivers_at(const scene::Scene& scene, const trace::RayCaster& caster,
                                   std::span<const Vec3f> points, std::span<const Vec3f> normals,
                                   float within, const Workers& workers);

}  // namespace deltalux::direct
