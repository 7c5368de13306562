// SPDX-License-Identifier: Apache-2.0
// Convex polygons in a plane, such as the parts of triangles within a square.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <initializer_list>
#include <vector>

namespace deltalux {

/// In the coordinates of a plane; z is the height above it, where it is used.
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

/// Twice the area of the polygon's projection on the plane z = 0; negative if it turns clockwise.
inline double twice_area(const Polygon& polygon) {
  double twice = 0;
  for (size_t i = 2; i < polygon.size(); ++i)
    twice += (polygon[i - 1].x - polygon[0].x) * (polygon[i].y - polygon[0].y) -
             (polygon[i].x - polygon[0].x) * (polygon[i - 1].y - polygon[0].y);
  return twice;
}
inline double area_of(const Polygon& polygon) { return 0.5 * std::fabs(twice_area(polygon)); }

/// Adds the parts of `whole` outside of the convex polygon `hole` to `out`.
inline void add_outside(const Polygon& whole, const Polygon& hole, std::vector<Polygon>& out) {
  constexpr double kNothing = 1e-7;  // of the area: parts that rounding makes
  constexpr size_t kMany = 9;        // a polygon with more corners is divided, to keep its capacity
  const double twice = twice_area(hole);
  const double turn = twice < 0 ? -1 : 1;
  const auto inside = [&](size_t k, const Point& p) {
    const Point &a = hole[k], &b = hole[(k + 1) % hole.size()];
    return turn * ((b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x));
  };
  bool apart = hole.size() < 3 || twice == 0;
  for (size_t k = 0; k < hole.size(); ++k)
    apart |= std::none_of(whole.begin(), whole.end(), [&](auto& p) { return inside(k, p) > 0; });
  if (apart) return out.push_back(whole);
  const double least = kNothing * area_of(whole);
  Polygon rest = whole;
  for (size_t k = 0; k < hole.size() && rest.size() >= 3; ++k) {
    const Polygon part = clipped(rest, [&](const Point& p) { return -inside(k, p); });
    rest = clipped(rest, [&](const Point& p) { return inside(k, p); });
    if (!(area_of(part) > least)) continue;
    if (part.size() <= kMany) {
      out.push_back(part);
      continue;
    }
    Polygon halves[2];
    const size_t middle = part.size() / 2;
    for (size_t i = 0; i < part.size(); ++i) {
      if (i <= middle) halves[0].push_back(part[i]);
      if (i >= middle || i == 0) halves[1].push_back(part[i]);
    }
    out.insert(out.end(), {halves[0], halves[1]});
  }
}

}  // namespace deltalux
