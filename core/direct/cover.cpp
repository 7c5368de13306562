// SPDX-License-Identifier: Apache-2.0
// Clips what blocks the light out of its outline, in central projection from the receiver.
#include "direct/cover.h"

#include <algorithm>
#include <cmath>
#include <optional>
#include <vector>

#include "base/polygon.h"

namespace deltalux::direct {
namespace {

constexpr size_t kMostTriangles = 24;  // where more are needed, rays are not dearer
constexpr size_t kMostPieces = 48;
// Share of the outline that counts as nothing: a tenth of what the finest ray stands for.
constexpr double kNothing = 2e-5;
// Cosine, of the outline's points about its middle: beyond, projections are too large.
constexpr double kWidest = 0.05;
// Where surfaces between receiver and light begin and end, in distances of the light: it is a
// surface itself.
constexpr double kNear = 1e-6, kFar = 0.999;

/// Convex hull of points (Andrew 1979), counter-clockwise.
Polygon hull_of(std::vector<Point> points) {
  std::sort(points.begin(), points.end(),
            [](const Point& a, const Point& b) { return a.x != b.x ? a.x < b.x : a.y < b.y; });
  std::vector<Point> hull;
  const auto add = [&](const Point& p, size_t least) {
    const auto turns_left = [&] {
      const Point &a = hull[hull.size() - 2], &b = hull.back();
      return (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) > 0;
    };
    while (hull.size() >= least && !turns_left()) hull.pop_back();
    hull.push_back(p);
  };
  for (const Point& p : points) add(p, 2);
  const size_t lower = hull.size() + 1;
  for (size_t i = points.size() - 1; i-- > 0;) add(points[i], lower);
  hull.pop_back();
  Polygon out;
  for (const Point& p : hull) out.push_back(p);
  return out;
}

/// Central projection from the start of a receiver's shadow rays on a plane before the light.
class View {
 public:
  View(const LightShape& light, const Receiver& receiver)
      : from_(receiver.point + receiver.normal * receiver.slack()) {
    const std::span<const Vec3f> points = light.outline();
    Vec3d middle{};
    for (const Vec3f& p : points) middle = middle + (Vec3d(p) - Vec3d(from_));
    if (!(length(middle) > 0)) return;
    axis_ = normalize(middle);
    tangent_frame(axis_, u_, v_);
    depth_ = std::numeric_limits<double>::max();
    std::vector<Point> seen;
    for (const Vec3f& p : points) {
      const Point solid = in_frame(p);
      if (!(solid.z > kWidest * length(Vec3d(p) - Vec3d(from_)))) return;
      depth_ = std::min(depth_, solid.z);
      seen.push_back({solid.x / solid.z, solid.y / solid.z});
    }
    depth_ *= kFar;
    const Vec3d n(receiver.normal);
    outline_ = clipped(hull_of(std::move(seen)), [&](const Point& p) { return dot(n, ray(p)); });
  }
  /// The light above the receiver's horizon; empty where it is not seen as a whole.
  const Polygon& outline() const { return outline_; }
  Vec3f from() const { return from_; }
  /// The ray towards a point of the projection, which ends before any point of the light.
  Vec3d ray(const Point& p) const { return (u_ * p.x + v_ * p.y + axis_) * depth_; }
  /// What a triangle hides.
  Polygon shadow(const trace::Corners& triangle) const {
    Polygon solid;
    for (const Vec3f& p : triangle) solid.push_back(in_frame(p));
    solid = clipped(solid, [&](const Point& p) { return p.z - kNear * depth_; });
    solid = clipped(solid, [&](const Point& p) { return depth_ - p.z; });
    Polygon out;
    for (const Point& p : solid) out.push_back({p.x / p.z, p.y / p.z});
    return out;
  }

 private:
  Point in_frame(Vec3f p) const {
    const Vec3d d = Vec3d(p) - Vec3d(from_);
    return {dot(d, u_), dot(d, v_), dot(d, axis_)};
  }

  Vec3f from_;
  Vec3d axis_, u_, v_;
  double depth_ = 0;  // a little less than the least distance of the light along the axis
  Polygon outline_;
};

Point middle_of(const Polygon& polygon) {
  Point sum{0, 0};
  for (const Point& p : polygon) sum.x += p.x, sum.y += p.y;
  return {sum.x / double(polygon.size()), sum.y / double(polygon.size())};
}

}  // namespace

bool is_covered(const trace::RayCaster& caster, const LightShape& light, const Receiver& receiver,
                std::span<const uint32_t> movables) {
  const View view(light, receiver);
  const double all = area_of(view.outline());
  if (!(all > 0) || !std::isfinite(all)) return false;
  const auto blocker = [&](Vec3f d) {
    std::optional<trace::Corners> found;
    if (receiver.object != scene::kNone) found = caster.blocker(receiver.object, view.from(), d, 1);
    if (!found) found = caster.blocker(scene::kNone, view.from(), d, 1);
    for (size_t i = 0; i < movables.size() && !found; ++i)
      found = caster.blocker(movables[i], view.from(), d, 1);
    return found;
  };
  std::vector<Polygon> pieces{view.outline()}, rest;
  for (size_t k = 0; k < kMostTriangles; ++k) {
    const auto by_area = [](const Polygon& a, const Polygon& b) { return area_of(a) < area_of(b); };
    const Polygon& largest = *std::max_element(pieces.begin(), pieces.end(), by_area);
    const auto triangle = blocker(Vec3f(view.ray(middle_of(largest))));
    if (!triangle) return false;
    const Polygon shadow = view.shadow(*triangle);
    rest.clear();
    for (const Polygon& piece : pieces) add_outside(piece, shadow, rest);
    pieces.swap(rest);
    double left = 0;
    for (const Polygon& piece : pieces) left += area_of(piece);
    if (!(left > kNothing * all)) return true;
    if (pieces.size() > kMostPieces) return false;
  }
  return false;
}

}  // namespace deltalux::direct
