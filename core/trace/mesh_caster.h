// SPDX-License-Identifier: Apache-2.0
// Rays against one triangle mesh that belongs to no scene, for pictures and places.
#pragma once
#include <array>
#include <cstdint>
#include <vector>

#include "trace/embree_scene.h"

namespace deltalux::trace {

/// The point is corner 0 + u (corner 1 - corner 0) + v (corner 2 - corner 0) of the triangle.
struct MeshHit {
  float t = std::numeric_limits<float>::infinity();
  uint32_t triangle = scene::kNone;
  float u = 0, v = 0;
};

class MeshCaster {
 public:
  /// Vertices are finite, triangles' corners among them. Throws Error.
  MeshCaster(std::vector<Vec3f> vertices, std::vector<std::array<uint32_t, 3>> triangles);

  MeshHit closest(Vec3f origin, Vec3f direction) const;
  const EmbreeScene& scene() const { return scene_; }

 private:
  std::vector<Vec3f> vertices_;
  std::vector<std::array<uint32_t, 3>> triangles_;
  EmbreeDevice device_;
  EmbreeScene scene_;
};

}  // namespace deltalux::trace
