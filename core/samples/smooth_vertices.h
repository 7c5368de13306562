// SPDX-License-Identifier: Apache-2.0
// Vertices for smooth shading: corners of triangles that continue each other without a crease form
// one vertex, with one normal and one place where light is computed. Corner k of triangle t, and
// the edge from it to the next corner, have the index 3 t + k.
#pragma once
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

/// A mesh, and which of its edges are smooth.
struct ShadedMesh {
  std::span<const Vec3d> points;
  std::span<const Triangle> triangles;
  /// by triangle: cosine of the largest angle that counts as smooth
  std::span<const double> cosine;
  /// Edges that are never smooth; marked on one side or on both.
  std::span<const uint8_t> parted;
  std::span<const uint8_t> beside;  ///< edges beyond which the surface is covered
};

struct SmoothVertices {
  /// by corner: its vertex; numbered in the order of first corners
  std::vector<int64_t> of_corner;
  std::vector<int64_t> corner;  ///< by vertex: one of its corners
  /// Mean of the faces' normals, weighted by their angles at the vertex; unit length.
  std::vector<Vec3d> normal;
  /// Offset from the vertex to the place where light is computed: into the adjacent faces if these
  /// do not surround the vertex, or away from what covers the surface; otherwise zero.
  std::vector<Vec3d> inset;
};

/// `farthest`: length of insets in metres; they are at most `share` of the smallest height of the
/// adjacent faces. Returns nothing if there are more vertices than `most`.
std::optional<SmoothVertices> smooth_vertices(const ShadedMesh& mesh, double farthest, double share,
                                              size_t most);

}  // namespace deltalux::samples
