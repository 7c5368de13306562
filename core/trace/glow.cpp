// SPDX-License-Identifier: Apache-2.0
// Quarters triangles down to a few texels, then keeps the divisions that tell most.
#include "trace/glow.h"

#include <algorithm>
#include <cmath>
#include <queue>

#include "base/polygon.h"
#include "surfaces/texture.h"

namespace deltalux::trace {
namespace {

constexpr size_t kMostParts = 512;       // of one material of an object: each costs every receiver
constexpr size_t kMostLeaves = 1 << 15;  // some for each part
constexpr int kDeepest = 9;
constexpr double kTexelsInLeaf = 1.0 / 16;
constexpr double kMostSquares = 64;  // of texels, or of their means, that are integrated in a leaf
constexpr double kEven = 0.02;  // of the light: how much of it may lie elsewhere than it is said to
// In texels: places beyond are too coarse in single precision.
constexpr double kFarthest = 1 << 24;

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

/// The lines between the squares of a grid along an axis. Each copy of the image has its own grid,
/// whose last squares are cut off.
struct Grid {
  double step, size;
  bool mirrors;  ///< every other copy
  /// The next line behind a place.
  double after(double at) const {
    const double copy = std::floor(at / size), local = at - copy * size;
    const bool turned = mirrors && std::fmod(copy, 2) != 0;
    const double next = turned ? size - (std::ceil((size - local) / step) - 1) * step
                               : std::min((std::floor(local / step) + 1) * step, size);
    constexpr double kLeast = 1e-6;  // of rounding
    return std::max(copy * size + next, at + kLeast);
  }
};

/// Calls visit() for what a convex polygon has between each two lines of a grid along an axis.
template <class Visit>
void each_slice(const Polygon& whole, int axis, const Grid& grid, const Visit& visit) {
  double low = INFINITY, high = -INFINITY;
  for (const Point& p : whole)
    low = std::min(low, along(p, axis)), high = std::max(high, along(p, axis));
  Polygon rest = whole;
  for (double at = grid.after(low); at < high; at = grid.after(at)) {
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
      : object_(object),
        material_(material),
        map_(*material.glow),
        size_{double(map_.texture->width()), double(map_.texture->height())} {}

  std::vector<LightPart> divide(std::span<const LightPart> parts) {
    for (const LightPart& part : parts) add_root(part);
    size_t leaves = 0;
    for (deepest_ = kDeepest; deepest_ > 0; --deepest_) {
      leaves = 0;
      for (const Node& root : nodes_) leaves += size_t(1) << 2 * depth_of(root);
      if (leaves <= kMostLeaves) break;
    }
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
    const double covered =
        0.5 * std::fabs((e[0] * f[1] - e[1] * f[0]) * scale) * size_[0] * size_[1];
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

  /// In texels; not finite where it is too far.
  Place in_image(const Place& at) const {
    const auto& m = map_.matrix;
    Place out{double(m[0][0]) * at[0] + double(m[0][1]) * at[1] + double(m[0][2]),
              double(m[1][0]) * at[0] + double(m[1][1]) * at[1] + double(m[1][2])};
    for (size_t k = 0; k < 2; ++k) {
      out[k] *= size_[k];
      if (!(std::fabs(out[k]) < kFarthest)) out[k] = NAN;
    }
    return out;
  }

  /// The mean of the smallest squares of texels of which few are on the node.
  Vec3d mean_of(const Node& node) const {
    Polygon whole;
    double low[2] = {INFINITY, INFINITY}, high[2] = {-INFINITY, -INFINITY};
    for (const Corner& corner : node.corner) {
      const Place at = in_image(corner.place);
      if (!std::isfinite(at[0] + at[1])) return Vec3d(material_.emission);
      whole.push_back({at[0], at[1]});
      for (size_t k = 0; k < 2; ++k)
        low[k] = std::min(low[k], at[k]), high[k] = std::max(high[k], at[k]);
    }
    const surfaces::Mipmap& mipmap = map_.texture->mipmap();
    const auto squares = [&](uint32_t level) {
      const double side = std::ldexp(1.0, int(level));
      return ((high[0] - low[0]) / side + 1) * ((high[1] - low[1]) / side + 1);
    };
    uint32_t level = 0;
    while (level < mipmap.levels() && squares(level) > kMostSquares) ++level;
    if (squares(level) > kMostSquares)
      return Vec3d(surfaces::product(mipmap.at(level, 0, 0), map_.gain));
    if (level == 0) return exact_mean(whole);
    return integrated(whole, std::ldexp(1.0, int(level)), [&](const Polygon& own) {
      Point middle{0, 0};
      for (const Point& p : own)
        middle.x += p.x / double(own.size()), middle.y += p.y / double(own.size());
      const size_t column = texel_at(middle.x, 0) >> level, row = texel_at(middle.y, 1) >> level;
      return Vec3d(surfaces::product(mipmap.at(level, column, row), map_.gain));
    });
  }

  /// The column or row of the texel at a place, which the image's edges wrap.
  size_t texel_at(double at, size_t axis) const {
    const double own = size_[axis] * surfaces::wrapped(at / size_[axis], map_.sampler.wrap[axis]);
    return size_t(std::min(own, size_[axis] - 1));
  }

  /// The mean over a polygon of what mean(part) is on its parts in the squares of a grid.
  template <class Mean>
  Vec3d integrated(const Polygon& whole, double step, const Mean& mean) const {
    const auto grid = [&](size_t axis) {
      return Grid{step, size_[axis], map_.sampler.wrap[axis] == surfaces::Wrap::mirror};
    };
    Vec3d sum{};
    double all = 0;
    each_slice(whole, 1, grid(1), [&](const Polygon& band) {
      each_slice(band, 0, grid(0), [&](const Polygon& own) {
        const double area = own.size() > 2 ? area_of(own) : 0;
        if (area > 0) sum = sum + mean(own) * area, all += area;
      });
    });
    return all > 0 ? sum * (1 / all) : mean(whole);
  }

  /// Texels as they are, or interpolated: between their middles, the radiance is a polynomial of
  /// the second degree, of which the means at the middles of a triangle's edges tell the integral.
  Vec3d exact_mean(const Polygon& triangle) const {
    const double shift = map_.sampler.nearest ? 0 : 0.5;
    Polygon whole;
    for (const Point& p : triangle) whole.push_back({p.x - shift, p.y - shift});
    const auto value_at = [&](const Point& p) {
      return radiance_at({(p.x + shift) / size_[0], (p.y + shift) / size_[1]});
    };
    return integrated(whole, 1, [&](const Polygon& own) {
      Vec3d sum{};
      double all = 0;
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
      return all > 0 ? sum * (1 / all) : value_at(own[0]);
    });
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
  const Place size_;  // of the image, in texels
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
