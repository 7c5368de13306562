// SPDX-License-Identifier: Apache-2.0
// Luminous surfaces whose texels differ: divides their triangles into parts that emit evenly.
#pragma once
#include <span>
#include <vector>

#include "scene/scene.h"
#include "trace/light_part.h"

namespace deltalux::trace {

/// Divides parts of triangles of one luminous material with a glow, each with the radiance of all
/// its points on average; those that emit nothing are left out. At most so many that lamps stay
/// cheap; where that is too few for the texels, each has their mean. A pure function of its
/// arguments.
std::vector<LightPart> divided_by_glow(const scene::Object& object, const scene::Material& material,
                                       std::span<const LightPart> parts);

}  // namespace deltalux::trace
