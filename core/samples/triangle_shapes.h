// SPDX-License-Identifier: Apache-2.0
// Normals, areas and widths of triangles over points that they share.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "samples/mesh_edges.h"

namespace deltalux::samples {

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
