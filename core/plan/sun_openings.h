// SPDX-License-Identifier: Apache-2.0
// Small openings through which beams of a sun enter, and the places before them that reflect its
// light into them. Hardly any path that lands there comes in, so that pilot paths do not tell.
#pragma once
#include <optional>
#include <vector>

#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::plan {

struct Opening {
  Vec3f centre;
  Vec3f normal;  ///< of the surface around it, towards the sun
  float radius;
};

/// The opening that lets in the beam which lands at `landing`, just above a surface; `to_sun`: unit
/// vector. nullopt if nothing surrounds the beam.
std::optional<Opening> find_opening(const trace::RayCaster& caster, Vec3f landing, Vec3f to_sun);

/// A place that an opening sees.
struct Reflector {
  Vec3f at;  ///< just above the surface
  Vec3f normal;
  uint32_t primitive;
  double chance;  ///< of a diffuse reflection there to enter
};

/// Places that cosine-distributed rays from an opening meet: if all were equally bright, each would
/// send the same power in.
std::vector<Reflector> reflectors_of(const scene::Scene& scene, const trace::RayCaster& caster,
                                     const Opening& opening, uint32_t count, uint64_t seed);

}  // namespace deltalux::plan
