// SPDX-License-Identifier: Apache-2.0
// Convex polygons in a plane: what triangles leave of a square.
#pragma once
#include <cmath>
#include <vector>

namespace deltalux::gather {

/// Coordinates in a patch's frame; z is the height above it, where it matters.
struct Point {
  double x, y, z = 0;
};
using Polygon = std::vector<Point>;

/// What of `polygon` lies where `height`(point), a linear function, is not negative.
template <class Height>
Polygon clipped(const Polygon& polygon, const Height& height) {
  Polygon out;
  for (size_t i = 0; i < polygon.size(); ++i) {
    const Point &p = polygon[i], &q = polygon[(i + 1) % polygon.size()];
    const double a = height(p), b = height(q);
    if (a >= 0) out.push_back(p);
    if ((a >= 0) == (b >= 0)) continue;
    const double t = a / (a - b);
    out.push_back({p.x + (q.x - p.x) * t, p.y + (q.y - p.y) * t, p.z + (q.z - p.z) * t});
  }
  return out;
}

/// Of its projection on the frame's plane.
inline double area_of(const Polygon& polygon) {
  double twice = 0;
  for (size_t i = 2; i < polygon.size(); ++i)
    twice += (polygon[i - 1].x - polygon[0].x) * (polygon[i].y - polygon[0].y) -
             (polygon[i].x - polygon[0].x) * (polygon[i - 1].y - polygon[0].y);
  return 0.5 * std::fabs(twice);
}

}  // namespace deltalux::gather
