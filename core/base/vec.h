// SPDX-License-Identifier: Apache-2.0
// Small vectors and boxes. Expressions are evaluated in a fixed order, so that results are
// reproducible.
#pragma once
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>

namespace deltalux {

template <class T>
struct Vec3 {
  T x{}, y{}, z{};

  friend constexpr Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
  friend constexpr Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
  friend constexpr Vec3 operator*(Vec3 a, T s) { return {a.x * s, a.y * s, a.z * s}; }
  friend constexpr Vec3 operator*(T s, Vec3 a) { return a * s; }
  constexpr Vec3 operator-() const { return {-x, -y, -z}; }
  constexpr T operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
  constexpr T& operator[](int axis) { return axis == 0 ? x : axis == 1 ? y : z; }
  friend constexpr bool operator==(const Vec3&, const Vec3&) = default;
  template <class U>
  constexpr explicit operator Vec3<U>() const {
    return {static_cast<U>(x), static_cast<U>(y), static_cast<U>(z)};
  }
};

using Vec3f = Vec3<float>;
using Vec3d = Vec3<double>;

/// The largest distance from the origin, in metres: beyond it, products of coordinates could
/// overflow, and Embree may crash for rays from beyond 1.8e18 m.
inline constexpr float kFarthest = 1e15f;

template <class T>
constexpr T dot(Vec3<T> a, Vec3<T> b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}
template <class T>
constexpr Vec3<T> cross(Vec3<T> a, Vec3<T> b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}
template <class T>
T length(Vec3<T> a) {
  return std::sqrt(dot(a, a));
}
/// The axis along which a vector is longest; of equals, the first.
template <class T>
int main_axis(Vec3<T> a) {
  int axis = 0;
  for (int k = 1; k < 3; ++k)
    if (std::abs(a[k]) > std::abs(a[axis])) axis = k;
  return axis;
}
template <class T>
Vec3<T> normalize(Vec3<T> a) {
  return a * (T(1) / length(a));
}
template <class T>
constexpr Vec3<T> min(Vec3<T> a, Vec3<T> b) {
  return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)};
}
template <class T>
constexpr Vec3<T> max(Vec3<T> a, Vec3<T> b) {
  return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)};
}

/// The photopic share of linear RGB (Rec. 709).
constexpr double photopic(Vec3d c) { return 0.2126 * c.x + 0.7152 * c.y + 0.0722 * c.z; }

/// Two unit vectors that complete `n` to a right-handed frame (Duff et al. 2017, JCGT 6(1)).
template <class T>
void tangent_frame(Vec3<T> n, Vec3<T>& u, Vec3<T>& v) {
  const T sign = std::copysign(T(1), n.z);
  const T a = T(-1) / (sign + n.z);
  const T b = n.x * n.y * a;
  u = {T(1) + sign * n.x * n.x * a, sign * b, -sign * n.x};
  v = {b, sign + n.y * n.y * a, -n.y};
}

/// Transforms `local` from tangent_frame(n), with n as its third axis, to the space of n.
inline Vec3f turned(Vec3f local, Vec3f n) {
  Vec3f u, v;
  tangent_frame(n, u, v);
  return u * local.x + v * local.y + n * local.z;
}

/// Half of the surface of a box.
inline float half_area(Vec3f extent) {
  return extent.x * extent.y + extent.y * extent.z + extent.z * extent.x;
}

/// Bound of the rounding errors of a ray's origin or end near a surface at `p`: 32 rounding errors
/// of single precision (24 bits), for coordinates and for distances of the same magnitude.
inline float position_slack(Vec3f p) {
  return 0x1p-19f * std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
}

struct Box {
  Vec3f low{std::numeric_limits<float>::infinity(), std::numeric_limits<float>::infinity(),
            std::numeric_limits<float>::infinity()};
  Vec3f high{-std::numeric_limits<float>::infinity(), -std::numeric_limits<float>::infinity(),
             -std::numeric_limits<float>::infinity()};

  bool empty() const { return !(low.x <= high.x); }
  void grow(Vec3f p) { low = min(low, p), high = max(high, p); }
  void grow(const Box& b) { low = min(low, b.low), high = max(high, b.high); }
  Box padded(float by) const {
    return empty() ? *this : Box{low - Vec3f{by, by, by}, high + Vec3f{by, by, by}};
  }
  Vec3f centre() const { return (low + high) * 0.5f; }
  Vec3f extent() const { return empty() ? Vec3f{} : high - low; }
  float diagonal() const { return length(extent()); }
  float half_area() const { return deltalux::half_area(extent()); }
  /// Largest absolute coordinate; 0 if empty.
  float reach() const {
    if (empty()) return 0;
    const Vec3f far = max(high, -low);
    return std::max({far.x, far.y, far.z});
  }
  bool contains(const Box& b) const {
    return b.empty() || (low.x <= b.low.x && low.y <= b.low.y && low.z <= b.low.z &&
                         b.high.x <= high.x && b.high.y <= high.y && b.high.z <= high.z);
  }
  friend bool operator==(const Box&, const Box&) = default;
  bool overlaps(const Box& b) const {
    return low.x <= b.high.x && b.low.x <= high.x && low.y <= b.high.y && b.low.y <= high.y &&
           low.z <= b.high.z && b.low.z <= high.z;
  }
  /// Whether the sphere touches the box.
  bool touches_sphere(Vec3f c, float radius) const {
    const Vec3f nearest = max(low, min(c, high)) - c;
    return dot(nearest, nearest) <= radius * radius;
  }
};

/// Distance from `o` along `d` to the border of the box, if `o` is inside; 0 if outside.
inline float distance_to_border(const Box& box, Vec3f o, Vec3f d) {
  float leave = std::numeric_limits<float>::infinity();
  for (int axis = 0; axis < 3; ++axis) {
    const float to = d[axis] > 0 ? box.high[axis] : box.low[axis];
    const float t = d[axis] != 0 ? (to - o[axis]) / d[axis] : leave;
    if (t < leave) leave = t;
  }
  return std::max(0.0f, leave);
}

/// A ray with precomputed inverse direction, for conservative box tests.
struct SlabRay {
  Vec3f origin, inverse;
  SlabRay(Vec3f o, Vec3f d) : origin(o), inverse{1.0f / d.x, 1.0f / d.y, 1.0f / d.z} {}
  /// Distance at which the ray enters `box` within [0, end], or infinity. NaN from 0*inf counts as
  /// inside.
  float entry(const Box& box, float end) const {
    float enter = 0.0f, leave = end;
    for (int axis = 0; axis < 3; ++axis) {
      const float a = (box.low[axis] - origin[axis]) * inverse[axis];
      const float b = (box.high[axis] - origin[axis]) * inverse[axis];
      const float near = std::min(a, b), far = std::max(a, b);
      if (near > enter) enter = near;
      if (far < leave) leave = far;
    }
    return enter <= leave ? enter : std::numeric_limits<float>::infinity();
  }
};

}  // namespace deltalux
