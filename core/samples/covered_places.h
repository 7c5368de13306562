// SPDX-License-Identifier: Apache-2.0
// Finds covered places, which nothing can reach because something stands on them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "trace/embree_scene.h"

namespace deltalux::samples {

/// A layer holds surfaces whose front sides light may reach. Sheets that light may reach from both
/// sides are also in another layer, with the opposite winding.
using Layers = std::span<const trace::EmbreeScene* const>;

/// Returns 1 for each place from which almost every ray hits something within `contact` metres, or
/// hits a back side: under a bookcase, behind a frame, inside a column. `origins` are slightly
/// above the surface; `normals` are unit vectors.
std::vector<uint8_t> covered_places(Layers layers, std::span<const Vec3f> origins,
                                    std::span<const Vec3f> normals, float contact,
                                    const Workers& workers);

}  // namespace deltalux::samples
