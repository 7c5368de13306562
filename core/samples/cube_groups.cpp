// SPDX-License-Identifier: Apache-2.0
// Connected components of the edges that stay within one cube.
#include "samples/cube_groups.h"

#include <cmath>

#include "samples/components.h"

namespace deltalux::samples {

std::vector<int32_t> groups_in_cubes(std::span<const Vec3d> vertices,
                                     std::span<const Triangle> triangles,
                                     std::span<const int64_t> kind, double edge, double offset) {
  const auto cube = [&](double x) { return std::floor(x / edge + offset); };
  std::vector<Vec3d> cubes(vertices.size());
  for (size_t i = 0; i < cubes.size(); ++i)
    cubes[i] = {cube(vertices[i].x), cube(vertices[i].y), cube(vertices[i].z)};
  Components groups(vertices.size());
  for (const Triangle& triangle : triangles)
    for (size_t k = 0; k < 3; ++k) {
      const size_t a = size_t(triangle[k]), b = size_t(triangle[(k + 1) % 3]);
      if (kind[a] == kind[b] && cubes[a] == cubes[b]) groups.join(a, b);
    }
  return std::move(groups).numbers();
}

}  // namespace deltalux::samples
