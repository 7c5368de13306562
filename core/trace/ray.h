// SPDX-License-Identifier: Apache-2.0
// Arguments and results of ray queries.
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "base/vec.h"
#include "scene/scene.h"

namespace deltalux::trace {

struct Hit {
  float t = std::numeric_limits<float>::infinity();
  uint32_t primitive = scene::kNone;  ///< in the numbering of Scene
  Vec3f normal{};      ///< geometric normal; its side follows the winding; not normalised
  float u = 0, v = 0;  ///< barycentrics, see surfaces::SurfacePoint
  bool valid() const { return primitive != scene::kNone; }
};

/// Corners of a triangle, in world space.
using Corners = std::array<Vec3f, 3>;

/// Shadow rays from one point: origin + t * (x, y, z)[i] for 0 < t <= to.
struct RayFan {
  static constexpr size_t kMaxRays = 256;
  Vec3f origin;
  float to = 1;
  size_t count = 0;
  alignas(64) std::array<float, kMaxRays> x, y, z;  ///< directions, not necessarily normalised
};
using RayBits = std::array<uint64_t, RayFan::kMaxRays / 64>;  ///< one bit per ray of a fan

/// A point where a line goes through a surface.
struct Intersection {
  float t;
  int into;            ///< +1 from front to back, -1 from back to front
  uint32_t primitive;  ///< within its own acceleration structure
};

}  // namespace deltalux::trace
