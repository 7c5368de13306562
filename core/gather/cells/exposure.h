// SPDX-License-Identifier: Apache-2.0
// What small triangles hide from each other: leaves of a bush, blades of grass, litter.
#pragma once
#include <functional>
#include <vector>

#include "base/parallel.h"
#include "gather/cells/body_cells.h"
#include "scene/scene.h"
#include "trace/ray_caster.h"

namespace deltalux::gather {

/// The first hit of a ray with the body's own geometry, up to a distance.
using Closest = std::function<trace::Hit(Vec3f origin, Vec3f direction, float to)>;

/// By cell of a body (kNone: the static geometry): the share of its area that counts; 1 but for
/// clumps. Light from afar lands where a clump is exposed, and just there rays from afar hit it. So
/// they see more light than is there on average: if light is in proportion to the exposure e, by a
/// factor of mean(e^2) / mean(e)^2. `near`: by cell, see Cells::near(). A pure function of the
/// body's geometry. Throws Cancelled.
std::vector<float> exposed_shares(const scene::Scene& scene, uint32_t body, const BodyCells& cells,
                                  const float* near, const Closest& closest, const Workers& workers,
                                  const Progress& progress);

}  // namespace deltalux::gather
