// SPDX-License-Identifier: Apache-2.0
// Normals, areas and widths of indexed triangles.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

using Corners = std::array<Vec3d, 3>;

/// The triangle's normal; its length is twice the area.
inline Vec3d doubled_area(const Corners& c) { return cross(c[1] - c[0], c[2] - c[0]); }
/// Scalar product with terms added in the order x, z, y. This keeps display meshes bit-identical:
/// comparisons of these products decide which edges are split and which faces are smooth.
inline double inner(Vec3d a, Vec3d b) { return a.x * b.x + a.z * b.z + a.y * b.y; }

/// Normals whose lengths are twice the triangles' areas.
std::vector<Vec3d> normals_by_area(std::span<const Vec3d> points,
                                   std::span<const Triangle> triangles);
std::vector<double> areas(std::span<const Vec3d> points, std::span<const Triangle> triangles);

/// 1 for each triangle whose area is 0 up to rounding.
std::vector<uint8_t> without_area(std::span<const Vec3d> points,
                                  std::span<const Triangle> triangles);
/// 1 for each triangle whose longest edge is at least `longest`, and whose height above that edge
/// is at least `narrowest`.
std::vector<uint8_t> wide_triangles(std::span<const Vec3d> points,
                                    std::span<const Triangle> triangles, double longest,
                                    double narrowest);

}  // namespace deltalux::samples
