// SPDX-License-Identifier: Apache-2.0
// What ratios refer to: Embree's closest hit in the static geometry, ray by ray.
#pragma once
#include <cstdio>
#include <vector>

#include "timing.h"
#include "trace/ray_caster.h"

namespace deltalux::benchmarks {

struct Rays {
  std::vector<Vec3f> origin, direction;
};

/// CPU time of one ray.
inline double raw_ray_ns(const trace::RayCaster& caster, const Rays& rays) {
  const double start = cpu_seconds();
  float sink = 0;
  for (size_t i = 0; i < rays.origin.size(); ++i)
    sink += caster.closest_static(rays.origin[i], rays.direction[i]).t < 1 ? 1.0f : 0.0f;
  const double ns = 1e9 * (cpu_seconds() - start) / double(rays.origin.size());
  if (sink < 0) std::puts("");  // so that the rays are needed
  return ns;
}

/// The object that benchmarks move.
inline uint32_t first_movable(const scene::Scene& scene) {
  uint32_t object = 0;
  while (object < scene.objects.size() && !scene.objects[object].movable) ++object;
  return object;
}

}  // namespace deltalux::benchmarks
