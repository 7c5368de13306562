// SPDX-License-Identifier: Apache-2.0
// Interpolation of dense vertices from the samples of nearby groups.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

/// For each group, its vertex that is nearest to the group's centroid; the first of several. Groups
/// are numbered from 0 without gaps.
std::vector<int64_t> centroid_vertices(std::span<const Vec3d> points,
                                       std::span<const int64_t> group);

/// A mesh whose vertices form groups, each with a sample at one of its vertices.
struct GroupedMesh {
  std::span<const Vec3d> points, normals;
  std::span<const Triangle> triangles;
  /// Vertices of different kinds never share a sample.
  std::span<const int64_t> kind, group;
  std::span<const int64_t> vertex;  ///< by sample
};
struct SharingRule {
  double edge;          ///< of the groups' cubes: the unit of distances
  double reach;         ///< a sample serves vertices nearer than this
  double least_cosine;  ///< between the normals of a vertex and of a sample that serves it
  double least_bound;   ///< of the error bound, at the sample itself
};
inline constexpr size_t kNeighbours = 4;
struct SharedWeights {
  std::vector<std::array<int32_t, kNeighbours>> samples;
  std::vector<std::array<float, kNeighbours>> weights;  ///< each row adds up to 1
};

/// Weights of the samples that each of `others` is interpolated from: inverse squares of the
/// split-sphere error bound (Ward, Rubinstein & Clear 1988), of those samples in `near` that serve
/// the vertex. The last one of `near` is replaced by the sample of the vertex's own group, which
/// gets the whole weight if none serves. A sample must be at most two groups away along the mesh:
/// places that are close in space may be far apart on it, for example behind a partition.
SharedWeights shared_weights(const GroupedMesh& mesh, std::span<const int64_t> others,
                             std::span<const std::array<int64_t, kNeighbours>> near,
                             const SharingRule& rule, const Workers& workers);

}  // namespace deltalux::samples
