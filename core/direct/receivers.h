// SPDX-License-Identifier: Apache-2.0
// Receivers at arbitrary places of the present scene: finds the object that each lies on, and how
// accurately.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "direct/light_shape.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::direct {

/// The surface of a point is the one within `within` metres of it, if there is any.
std::vector<Receiver> receivers_at(const scene::Scene& scene, const trace::RayCaster& caster,
                                   std::span<const Vec3f> points, std::span<const Vec3f> normals,
                                   float within, const Workers& workers);

}  // namespace deltalux::direct
