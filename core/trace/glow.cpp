// SPDX-License-Identifier: Apache-2.0
// Quarters triangles down to a few texels, then keeps the divisions that tell most.
#include "trace/glow.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "base/polygon.h"
#include "base/random.h"
#include "surfaces/texture.h"

namespace deltalux::trace {
namespace {

constexpr size_t kMostParts = 512;  // of one material of an object: each costs every receiver
constexpr size_t kMostLeaves = 1 << 17;
constexpr double kTexelsInLeaf = 1.0 / 16;
constexpr double kMostTexels = 1 << 23;  // that are integrated one by one
constexpr double kEven = 0.02;  // of the light: how much of it may lie elsewhere than it is said to
constexpr size_t kMostPoints = 1 << 22;  // that are read instead

using Place = std::array<double, 2>;

struct Corner {
  Vec3f point;
  Place place;
};

Corner middle(const Corner& a, const Corner& b) {
  return {(a.point + b.point) * 0.5f,
          {0.5 * (a.place[0] + b.place[0]), 0.5 * (a.place[1] + b.place[1])}};
}

double along(const Point& p, int axis) { return axis ? p.y : p.x; }

/// Calls visit() for what a convex polygon has between each two whole numbers along an axis.
template <class Visit>
void each_slice(const Polygon& whole, int axis, const Visit& visit) {
  double low = INFINITY, high = -INFINITY;
  for (const Point& p : whole)
    low = std::min(low, along(p, axis)), high = std::max(high, along(p, axis));
  Polygon rest = whole;
  for (double at = std::floor(low) + 1; at < high; ++at) {
    visit(clipped(rest, [&](const Point& p) { return at - along(p, axis); }));
    rest = clipped(rest, [&](const Point& p) { return along(p, axis) - at; });
  }
  visit(rest);
}

/// A triangle, and its quarters unless it is a leaf.
struct Node {
  std::array<Corner, 3> corner;
  uint32_t triangle = 0;
  uint32_t first = 0;  ///< of four children; 0: a leaf
  double area = 0;
  Vec3d radiance{};   ///< mean
  double uneven = 0;  ///< bound of how much light the mean has in the wrong places
};

class Glow {
 public:
  Glow(const scene::Object& object, const scene::Material& material)
      : object_(object), material_(material), map_(*material.glow) {}

  std::vector<LightPart> divide(std::span<const LightPart> parts) {
    for (const LightPart& part : parts) add_root(part);
    size_t leaves = 0;
    for (deepest_ = 9; deepest_ > 0; --deepest_) {
      leaves = 0;
      for (const Node& root : nodes_) leaves += size_t(1) << 2 * depth_of(root);
      if (leaves <= kMostLeaves) break;
    }
    double covered = 0;
    for (const Node& root : nodes_) covered += texels(root);
    is_exact_ = covered <= kMostTexels;
    points_ = uint32_t(std::clamp<size_t>(kMostPoints / std::max<size_t>(leaves, 1), 16, 1024));
    const size_t roots = nodes_.size();
    for (uint32_t i = 0; i < roots; ++i) build(i, depth_of(nodes_[i]));
    return chosen(roots);
  }

 private:
  /// Where a point of the object's triangle lies in the image; not finite without coordinates.
  Place place_of(uint32_t triangle, Vec3f point) const {
    if (object_.texture.empty()) return {NAN, NAN};
    const auto& index = object_.triangles[triangle];
    const Vec3d a(object_.vertices[index[0]]), e(Vec3d(object_.vertices[index[1]]) - a),
        f(Vec3d(object_.vertices[index[2]]) - a), d(Vec3d(point) - a), n = cross(e, f);
    const double all = dot(n, n), u = dot(cross(d, f), n) / all, v = dot(cross(e, d), n) / all;
    const auto& own = object_.texture[triangle];
    Place at;
    for (size_t k = 0; k < 2; ++k)
      at[k] = double(own[0][k]) + u * (double(own[1][k]) - double(own[0][k])) +
              v * (double(own[2][k]) - double(own[0][k]));
    return at;
  }

  void add_root(const LightPart& part) {
    Node root;
    root.triangle = part.triangle;
    for (size_t k = 0; k < 3; ++k)
      root.corner[k] = {part.corner[k], place_of(part.triangle, part.corner[k])};
    nodes_.push_back(root);
  }

  /// Texels on the node; 0 where there are none.
  double texels(const Node& node) const {
    const auto& [a, b, c] = node.corner;
    const double e[2] = {b.place[0] - a.place[0], b.place[1] - a.place[1]},
                 f[2] = {c.place[0] - a.place[0], c.place[1] - a.place[1]};
    const auto& m = map_.matrix;
    const double scale = double(m[0][0]) * double(m[1][1]) - double(m[0][1]) * double(m[1][0]);
    const double covered = 0.5 * std::fabs((e[0] * f[1] - e[1] * f[0]) * scale) *
                           double(map_.texture->width()) * double(map_.texture->height());
    return std::isfinite(covered) ? covered : 0;
  }

  int depth_of(const Node& node) const {
    const double covered = texels(node);
    int depth = 0;
    for (double own = covered; own > kTexelsInLeaf && depth < deepest_; own /= 4) ++depth;
    return depth;
  }

  Vec3d radiance_at(const Place& at) const {
    return Vec3d(surfaces::product(
        map_.texture->at(float(at[0]), float(at[1]), map_.sampler).colour, map_.gain));
  }

  Place in_image(const Place& at) const {
    const auto& m = map_.matrix;
    return {double(m[0][0]) * at[0] + double(m[0][1]) * at[1] + double(m[0][2]),
            double(m[1][0]) * at[0] + double(m[1][1]) * at[1] + double(m[1][2])};
  }

  Vec3d mean_of(const Node& node) const {
    const double covered = texels(node);
    std::array<Place, 3> corner;
    for (size_t k = 0; k < 3; ++k) {
      corner[k] = in_image(node.corner[k].place);
      if (!std::isfinite(corner[k][0] + corner[k][1])) return Vec3d(material_.emission);
    }
    if (covered > 0 && is_exact_) return exact_mean(corner);
    const auto& [a, b, c] = corner;
    Vec3d sum{};
    for (uint32_t i = 0; i < points_; ++i) {
      double u = double(unit_float32(sobol::point(i, 0))),
             v = double(unit_float32(sobol::point(i, 1)));
      if (u + v > 1) u = 1 - u, v = 1 - v;
      sum = sum + radiance_at({a[0] + u * (b[0] - a[0]) + v * (c[0] - a[0]),
                               a[1] + u * (b[1] - a[1]) + v * (c[1] - a[1])});
    }
    return sum * (1.0 / points_);
  }

  /// Integrates over the squares between which texels are interpolated, or over texels: there, the
  /// radiance is a polynomial of the second degree, of which the means at the middles of a
  /// triangle's edges tell the integral.
  Vec3d exact_mean(const std::array<Place, 3>& triangle) const {
    const double size[2] = {double(map_.texture->width()), double(map_.texture->height())};
    const double shift = map_.sampler.nearest ? 0 : 0.5;
    Polygon whole;
    for (const Place& p : triangle)
      whole.push_back({p[0] * size[0] - shift, p[1] * size[1] - shift});
    const auto value_at = [&](const Point& p) {
      return radiance_at({(p.x + shift) / size[0], (p.y + shift) / size[1]});
    };
    Vec3d sum{};
    double all = 0;
    each_slice(whole, 1, [&](const Polygon& band) {
      each_slice(band, 0, [&](const Polygon& own) {
        for (size_t i = 2; i < own.size(); ++i) {
          const Point &a = own[0], &b = own[i - 1], &c = own[i];
          const double area = std::fabs((b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x));
          const auto between = [](const Point& p, const Point& q) {
            return Point{0.5 * (p.x + q.x), 0.5 * (p.y + q.y)};
          };
          const Vec3d value =
              map_.sampler.nearest
                  ? value_at({(a.x + b.x + c.x) / 3, (a.y + b.y + c.y) / 3})
                  : (value_at(between(a, b)) + value_at(between(b, c)) + value_at(between(c, a))) *
                        (1.0 / 3);
          sum = sum + value * area, all += area;
        }
      });
    });
    return all > 0 ? sum * (1 / all) : value_at(whole[0]);
  }

  void build(uint32_t number, int depth) {
    Node own = nodes_[number];
    const auto& [a, b, c] = own.corner;
    const LightPart part{own.triangle, {a.point, b.point, c.point}};
    own.area = part.area();
    if (depth == 0) {
      own.radiance = mean_of(own);
      nodes_[number] = own;
      return;
    }
    const Corner ab = middle(a, b), bc = middle(b, c), ca = middle(c, a);
    own.first = uint32_t(nodes_.size());
    for (const auto& corners : {std::array{a, ab, ca}, std::array{ab, b, bc}, std::array{ca, bc, c},
                                std::array{bc, ca, ab}}) {
      Node child;
      child.corner = corners, child.triangle = own.triangle;
      nodes_.push_back(child);
    }
    double all = 0;
    for (uint32_t k = 0; k < 4; ++k) {
      build(own.first + k, depth - 1);
      const Node& child = nodes_[own.first + k];
      own.radiance = own.radiance + child.radiance * child.area, all += child.area;
    }
    if (all > 0) own.radiance = own.radiance * (1 / all);
    for (uint32_t k = 0; k < 4; ++k) {
      const Node& child = nodes_[own.first + k];
      const Vec3d off = child.radiance - own.radiance;
      own.uneven += child.uneven +
                    child.area * std::max({std::fabs(off.x), std::fabs(off.y), std::fabs(off.z)});
    }
    nodes_[number] = own;
  }

  /// Divides the roots where most light would be in the wrong places, until little is.
  std::vector<LightPart> chosen(size_t roots) const {
    double all = 0, uneven = 0;
    // Of equal ones, the first comes first.
    std::priority_queue<std::pair<double, int64_t>> queue;
    for (size_t i = 0; i < roots; ++i) {
      const Vec3d& own = nodes_[i].radiance;
      all += nodes_[i].area * std::max({own.x, own.y, own.z});
      uneven += nodes_[i].uneven;
      queue.push({nodes_[i].uneven, -int64_t(i)});
    }
    while (queue.size() + 3 <= std::max(kMostParts, roots) && uneven > kEven * all) {
      const Node& top = nodes_[size_t(-queue.top().second)];
      queue.pop();
      uneven -= top.uneven;
      for (uint32_t k = 0; k < 4; ++k) {
        uneven += nodes_[top.first + k].uneven;
        queue.push({nodes_[top.first + k].uneven, -int64_t(top.first + k)});
      }
    }
    std::vector<size_t> numbers;
    for (; !queue.empty(); queue.pop()) numbers.push_back(size_t(-queue.top().second));
    std::sort(numbers.begin(), numbers.end());
    std::vector<LightPart> out;
    for (const size_t number : numbers) {
      const Node& own = nodes_[number];
      LightPart part{own.triangle, {}, Vec3f(own.radiance)};
      for (size_t k = 0; k < 3; ++k) part.corner[k] = own.corner[k].point;
      if (part.radiance != Vec3f{} && part.area() > 0) out.push_back(part);
    }
    return out;
  }

  const scene::Object& object_;
  const scene::Material& material_;
  const surfaces::TextureMap& map_;
  int deepest_ = 0;
  bool is_exact_ = true;
  uint32_t points_ = 1;      // in a leaf whose texels are too many
  std::vector<Node> nodes_;  // the roots come first
};

}  // namespace

std::vector<LightPart> divided_by_glow(const scene::Object& object, const scene::Material& material,
                                       std::span<const LightPart> parts) {
  return Glow(object, material).divide(parts);
}

}  // namespace deltalux::trace
