// SPDX-License-Identifier: Apache-2.0
// Normals, areas and widths of triangles over points that they share.
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

using Corners = std::array<Vec3d, 3>;

/// A triangle's normal, twice as long as it has area.
inline Vec3d doubled_area(const Corners& c) { return cross(c[1] - c[0], c[2] - c[0]); }
/// Scalar product whose terms are added in the order of x, z, y. Display meshes keep their bits
/// with it: what is compared here decides which edges are cut and which faces are smooth.
inline double inner(Vec3d a, Vec3d b) { return a.x * b.x + a.z * b.z + a.y * b.y; }

/// Normals, twice as long as the triangle has area.
std::vector<Vec3d> normals_by_area(std::span<const Vec3d> points,
                                   std::span<const Triangle> triangles);
std::vector<double> areas(std::span<const Vec3d> points, std::span<const Triangle> triangles);

/// 1 for each triangle that has no area but for rounding.
std::vector<uint8_t> without_area(std::span<const Vec3d> points,
                                  std::span<const Triangle> triangles);
/// 1 for each triangle whose longest edge is at least `longest`, and whose height above it at least
/// `narrowest`.
std::vector<uint8_t> wide_triangles(std::span<const Vec3d> points,
                                    std::span<const Triangle> triangles, double longest,
                                    double narrowest);

}  // namespace deltalux::samples
