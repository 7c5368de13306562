// SPDX-License-Identifier: Apache-2.0
// Vertices of smooth shading: the corners of triangles that continue each other without a crease
// are one vertex, with one normal and one place where light is asked. Corner k of triangle t, and
// the edge from it to the next one, have the number 3 t + k.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

/// A mesh, and over which of its edges shading is smooth.
struct ShadedMesh {
  std::span<const Vec3d> points;
  std::span<const Triangle> triangles;
  std::span<const double> cosine;   ///< of each triangle: of the largest angle that is smooth
  std::span<const uint8_t> parted;  ///< edges that are not, whatever the angle; of one side or both
  std::span<const uint8_t> beside;  ///< edges beyond which the surface is covered
};

struct SmoothVertices {
  std::vector<int64_t> of_corner;  ///< numbered in the order of their first corners
  std::vector<int64_t> corner;     ///< one of each vertex
  std::vector<Vec3d> normal;       ///< mean of the faces' normals, weighted by their angles; unit
  /// Where light is asked, from the vertex: into the faces around it where they do not close
  /// around it, away from what covers the surface; else zero.
  std::vector<Vec3d> inset;
};

/// `farthest`: metres, length of insets; they are no longer than `share` of the height of the faces
/// around. Nothing where there are more vertices than `most`.
std::optional<SmoothVertices> smooth_vertices(const ShadedMesh& mesh, double farthest, double share,
                                              size_t most);

}  // namespace deltalux::samples
