// SPDX-License-Identifier: Apache-2.0
// Averages over cells what their surfaces reflect, relative to the surfaces' means, and how much of
// them is there.
#pragma once
#include <span>
#include <vector>

#include "gather/cells/body_cells.h"
#include "scene/scene.h"

namespace deltalux::gather {

/// Whether the reflectance of some of these triangles differs from point to point.
bool any_varies(const scene::Scene& scene, std::span<const BodyCells::Triangle> triangles);

/// Appends the mean of Scene::tint_at() over each cell of a body, by diffuse share, from points
/// spread evenly over its triangles; multiplies the `areas` of its cells by the share that is no
/// hole. `first_primitive`: that of the body; `edge`: edge length of its squares. A pure function
/// of the triangles and their surfaces. Throws Cancelled.
void add_cell_tints(const scene::Scene& scene, uint32_t first_primitive,
                    std::span<const BodyCells::Triangle> triangles, const BodyCells& cells,
                    float edge, const Progress& progress, std::vector<Vec3f>& out,
                    std::span<float> areas);

}  // namespace deltalux::gather
