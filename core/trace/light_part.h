// SPDX-License-Identifier: Apache-2.0
// A piece of a luminous surface that emits evenly.
#pragma once
#include <cstdint>

#include "base/vec.h"

namespace deltalux::trace {

/// A triangle that emits, local to its object: one of the object's triangles, or a part of it.
struct LightPart {
  uint32_t triangle;  ///< index within the object
  Vec3f corner[3];
  Vec3f radiance{};  ///< of a light with a glow: the mean over the part
  double area() const {
    const Vec3d a(corner[0]), b(corner[1]), c(corner[2]);
    return 0.5 * length(cross(b - a, c - a));
  }
};

}  // namespace deltalux::trace
