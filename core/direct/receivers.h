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

/// Where light falls that is meant for the point `p` of a receiver: on the uppermost of several
/// sheets of its body that lie on it. `slack`: as of a receiver.
Vec3f onto_sheets(const trace::RayCaster& caster, uint32_t body, Vec3f p, Vec3f n, float slack);

/// The surface of a point is the one within `within` metres of it, if there is any.
std::vector<Receiver> receivers_at(const scene::Scene& scene, const trace::RayCaster& caster,
                                   std::span<const Vec3f> points, std::span<const Vec3f> normals,
                                   float within, const Workers& workers);

}  // namespace deltalux::direct
