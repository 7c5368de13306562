// SPDX-License-Identifier: Apache-2.0
// Convex polygons in a plane, such as the parts of triangles within a square.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>

namespace deltalux::gather {

/// In the coordinates of a patch; z is the height above it, where it is used.
struct Point {
  double x, y, z = 0;
};
/// A polygon with a fixed capacity. Each cut of a convex polygon adds at most one corner; the
/// capacity suffices for all cuts made here.
class Polygon {
 public:
  Polygon() {}
  // Copies only the points in use.
  Polygon(const Polygon& other) : count_(other.count_) {
    std::copy(other.begin(), other.end(), points_.begin());
  }
  Polygon& operator=(const Polygon& other) {
    count_ = other.count_;
    std::copy(other.begin(), other.end(), points_.begin());
    return *this;
  }
  Polygon(std::initializer_list<Point> points) {
    for (const Point& p : points) push_back(p);
  }
  /// Drops points beyond the capacity: rounding may bend slivers so that they would gain more
  /// corners.
  void push_back(const Point& p) {
    if (count_ < points_.size()) points_[count_++] = p;
  }
  size_t size() const { return count_; }
  const Point& operator[](size_t i) const { return points_[i]; }
  const Point* begin() const { return points_.data(); }
  const Point* end() const { return points_.data() + count_; }

 private:
  std::array<Point, 14> points_;
  size_t count_ = 0;
};

/// The part of `polygon` where `height`(point), a linear function, is not negative.
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

/// Area of the polygon's projection on the plane z = 0.
inline double area_of(const Polygon& polygon) {
  double twice = 0;
  for (size_t i = 2; i < polygon.size(); ++i)
    twice += (polygon[i - 1].x - polygon[0].x) * (polygon[i].y - polygon[0].y) -
             (polygon[i].x - polygon[0].x) * (polygon[i - 1].y - polygon[0].y);
  return 0.5 * std::fabs(twice);
}

}  // namespace deltalux::gather
