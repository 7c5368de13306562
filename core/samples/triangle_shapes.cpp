// SPDX-License-Identifier: Apache-2.0
// Applies a function to every triangle.
#include "samples/triangle_shapes.h"

#include <algorithm>
#include <cmath>

namespace deltalux::samples {
namespace {

// relative to the squared longest edge: twice the area below which a triangle is degenerate
constexpr double kNoArea = 1e-9;

Corners corners_of(std::span<const Vec3d> points, const Triangle& t) {
  return {points[size_t(t[0])], points[size_t(t[1])], points[size_t(t[2])]};
}

double longest_squared(const Corners& c) {
  const Vec3d a = c[1] - c[0], b = c[2] - c[1], d = c[0] - c[2];
  return std::max({inner(a, a), inner(b, b), inner(d, d)});
}

template <class T, class Of>
std::vector<T> each(std::span<const Vec3d> points, std::span<const Triangle> triangles,
                    const Of& of) {
  std::vector<T> out(triangles.size());
  for (size_t i = 0; i < out.size(); ++i) out[i] = of(corners_of(points, triangles[i]));
  return out;
}

}  // namespace

std::vector<Vec3d> normals_by_area(std::span<const Vec3d> points,
                                   std::span<const Triangle> triangles) {
  return each<Vec3d>(points, triangles, doubled_area);
}

std::vector<double> areas(std::span<const Vec3d> points, std::span<const Triangle> triangles) {
  return each<double>(points, triangles,
                      [](const Corners& c) { return 0.5 * length(doubled_area(c)); });
}

std::vector<uint8_t> without_area(std::span<const Vec3d> points,
                                  std::span<const Triangle> triangles) {
  return each<uint8_t>(points, triangles, [](const Corners& c) {
    return length(cross(c[1] - c[0], c[2] - c[1])) <= kNoArea * longest_squared(c);
  });
}

std::vector<uint8_t> wide_triangles(std::span<const Vec3d> points,
                                    std::span<const Triangle> triangles, double longest,
                                    double narrowest) {
  return each<uint8_t>(points, triangles, [&](const Corners& c) {
    const double edge = std::sqrt(longest_squared(c));
    return edge >= longest && length(doubled_area(c)) >= narrowest * edge;
  });
}

}  // namespace deltalux::samples
