// SPDX-License-Identifier: Apache-2.0
// Region queries of a ray map: segments that meet a sphere or a box.
#pragma once
#include <vector>

#include "estimate/ray_map/ray_map.h"

namespace deltalux::estimate {

/// Ids, ascending, of the segments that come within `radius` of `centre` up to their first hit.
std::vector<uint32_t> find_in_sphere(RayMap& map, Vec3f centre, float radius, RayMapStats& stats);
/// Ids, ascending, of the segments that meet the closed box up to their first hit.
std::vector<uint32_t> find_in_box(RayMap& map, const Box& box, RayMapStats& stats);

}  // namespace deltalux::estimate
