// SPDX-License-Identifier: Apache-2.0
// Places that nothing can reach, because something stands on them.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "trace/embree_scene.h"

namespace deltalux::samples {

/// One layer holds surfaces whose fronts light may reach. Of a sheet that light may reach from both
/// sides another layer holds the same triangles, wound the other way.
using Layers = std::span<const trace::EmbreeScene* const>;

/// 1 for each place from which nearly every ray meets something within `contact` metres, or meets
/// it from behind: under a bookcase, behind a frame, inside a column. `origins` lie a little above
/// the surface, `normals` are unit.
std::vector<uint8_t> covered_places(Layers layers, std::span<const Vec3f> origins,
                                    std::span<const Vec3f> normals, float contact,
                                    const Workers& workers);

}  // namespace deltalux::samples
