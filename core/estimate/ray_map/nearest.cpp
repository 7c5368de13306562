// SPDX-License-Identifier: Apache-2.0
// Finds the segments nearest to points. The tree is first split around all points, then around the
// balls that contain enough segments. The searches themselves only read it, so that the result does
// not depend on threads.
#include "estimate/ray_map/nearest.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <tuple>

namespace deltalux::estimate {
namespace {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// A segment as measured from a point. `place` is the segment's nearest point according to the
/// metric: the leaf that contains it counts the segment.
struct Measured {
  double distance, weight;
  Vec3d place;
};

struct Eye {
  Vec3d point, normal;
};

/// Computed in double precision, where products of two input numbers are exact.
std::optional<Measured> measure(const RayRecord& r, const Eye& eye, RayMetric metric,
                                segments::SegmentEnd rule) {
  const Vec3d o(r.origin), w(r.direction);
  const double facing = dot(eye.normal, w), length = r.length;
  if (!(facing < 0)) return std::nullopt;
  Measured m{0, 1, {}};
  if (metric == RayMetric::hit) {
    m.place = o + w * length;
  } else {
    const double s = dot(eye.normal, eye.point - o) / facing;
    const double end = rule == segments::SegmentEnd::first ? length : double(r.extended);
    if (!(s > 0 && s <= end)) return std::nullopt;
    double t = s;
    if (metric == RayMetric::line) {
      t = std::clamp(dot(eye.point - o, w) / dot(w, w), 0.0, s);
      // Lines of one direction within distance r pass through half an ellipse of the tangent plane,
      // where their nearest point is in front of it, and through half a disc, where it is the
      // crossing: pi r^2 (1 + cos) / 2 across the direction, instead of pi r^2 cos.
      m.weight = 2 * -facing / (1 - facing);
    }
    m.place = o + w * t;
    if (rule == segments::SegmentEnd::bounded)
      m.distance = (s - length) / double(segments::kBoundedRadii);
  }
  const Vec3d offset = m.place - eye.point;
  const double across = std::sqrt(dot(offset, offset));
  m.distance = std::max(m.distance, across);
  // An endless segment has no hit, and its coordinates may not be finite.
  if (!(across <= double(kFarthest))) return std::nullopt;
  return m;
}

/// Sorts equal distances by what the segments contribute, so that the result does not depend on the
/// order of segments.
struct Before {
  const uint32_t* power;
  bool operator()(const NearRay& a, const NearRay& b) const {
    const uint32_t *p = power + 3 * size_t(a.id), *q = power + 3 * size_t(b.id);
    return std::tie(a.distance, a.weight, p[0], p[1], p[2], a.id) <
           std::tie(b.distance, b.weight, q[0], q[1], q[2], b.id);
  }
};

class Search {
 public:
  Search(const RayMap& map, std::span<const uint32_t> power, const NearestOptions& options)
      : map_(map), options_(options), before_{power.data()} {}

  /// Finds the nearest segments in the leaf that contains the point. Returns their largest distance
  /// if there are k.
  double bound(const Eye& eye, Stats& stats) {
    begin(eye, kInfinity);
    const RayNode* node = &map_.root();
    Box cell = everything();
    while (node->child) {
      test(*node, cell, stats);
      const int side = eye.point[node->axis] < double(node->plane) ? 0 : 1;
      (side ? cell.low : cell.high)[node->axis] = node->plane;
      node = &node->child[side];
    }
    test(*node, cell, stats);
    return limit_;
  }

  std::span<const NearRay> nearest(const Eye& eye, double bound, Stats& stats) {
    begin(eye, bound);
    test(map_.odd(), everything(), stats);
    descend(map_.root(), everything(), stats);
    std::sort(found_.begin(), found_.end(), before_);
    return found_;
  }

 private:
  static Box everything() {
    constexpr float kOut = RayMap::kOutside;
    return {{-kOut, -kOut, -kOut}, {kOut, kOut, kOut}};
  }

  void begin(const Eye& eye, double bound) {
    eye_ = eye;
    limit_ = bound;
    found_.clear();
  }

  void test(const RayNode& node, const Box& cell, Stats& stats) {
    node.for_range(0, [&](std::span<const uint32_t> ids) { test_ids(ids, cell, stats); });
  }
  void test_ids(std::span<const uint32_t> ids, const Box& cell, Stats& stats) {
    stats.disc_tests += ids.size();
    for (const uint32_t id : ids) {
      const auto m = measure(map_.record(id), eye_, options_.metric, map_.rule());
      if (!m || m->distance > limit_ || !holds(cell, m->place)) continue;
      found_.push_back({m->distance, m->weight, id});
      std::push_heap(found_.begin(), found_.end(), before_);
      if (found_.size() > options_.k) {
        std::pop_heap(found_.begin(), found_.end(), before_);
        found_.pop_back();
      }
      if (found_.size() == options_.k) limit_ = std::min(limit_, found_.front().distance);
    }
  }

  static bool holds(const Box& cell, Vec3d p) {
    for (int axis = 0; axis < 3; ++axis)
      if (!(p[axis] >= double(cell.low[axis]) && p[axis] < double(cell.high[axis]))) return false;
    return true;
  }

  /// Whether nothing in the cell can be near enough.
  bool beyond(const Box& cell) const {
    if (limit_ == kInfinity) return false;
    const double slack = double(map_.margin()) + 1e-12 * limit_;
    double square = 0, least = 0, most = 0;  // least, most: height above the tangent plane
    for (int axis = 0; axis < 3; ++axis) {
      const double low = double(cell.low[axis]) - eye_.point[axis],
                   high = double(cell.high[axis]) - eye_.point[axis], n = eye_.normal[axis];
      const double out = std::max({low, -high, 0.0});
      square += out * out;
      least += std::min(low * n, high * n), most += std::max(low * n, high * n);
    }
    if (square > (limit_ + slack) * (limit_ + slack)) return true;
    if (options_.metric == RayMetric::hit) return false;
    return most < -slack || (options_.metric == RayMetric::crossing && least > slack);
  }

  void descend(const RayNode& node, const Box& cell, Stats& stats) {
    test(node, cell, stats);  // segments of an inner node have not been passed to its children yet
    if (!node.child) return;
    ++stats.node_tests;
    const int near = eye_.point[node.axis] < double(node.plane) ? 0 : 1;
    for (const int side : {near, 1 - near}) {
      Box part = cell;
      (side ? part.low : part.high)[node.axis] = node.plane;
      if (!beyond(part)) descend(node.child[side], part, stats);
    }
  }

  const RayMap& map_;
  const NearestOptions options_;
  const Before before_;
  Eye eye_;
  double limit_ = kInfinity;
  std::vector<NearRay> found_;  ///< a heap, the farthest first
};

}  // namespace

RayMapStats find_nearest(RayMap& map, std::span<const uint32_t> power,
                         std::span<const Vec3f> points, std::span<const Vec3f> normals,
                         const NearestOptions& options,
                         const std::function<void(size_t, std::span<const NearRay>)>& take,
                         const Workers& workers, Progress* progress) {
  constexpr size_t kGrain = 64;
  const size_t count = points.size();
  RayMapStats stats;
  std::vector<Stats> parts((count + kGrain - 1) / kGrain);
  std::vector<double> bounds(count);
  const auto each = [&](const char* stage, const auto& body) {
    if (progress) progress->begin(stage, count);
    workers.for_blocks(count, kGrain, [&](size_t begin, size_t end) {
      Search search(map, power, options);
      for (size_t i = begin; i < end; ++i) {
        if (progress) progress->check();
        body(search, i, Eye{Vec3d(points[i]), Vec3d(normals[i])}, parts[begin / kGrain]);
      }
      if (progress) progress->advance(end - begin);
    });
  };
  const RayMap::Query query{.radius = std::numeric_limits<float>::infinity()};
  const auto open = [&](std::span<const Box> boxes) {
    const RayMapStats opened = map.visit(boxes, query, {}, workers, progress);
    stats.tests += opened.tests;
    stats.splits += opened.splits, stats.refused += opened.refused;
  };

  std::vector<Box> boxes(count);
  for (size_t i = 0; i < count; ++i) boxes[i] = {points[i], points[i]};
  open(boxes);
  each("bounds", [&](Search& search, size_t i, const Eye& eye, Stats& part) {
    bounds[i] = search.bound(eye, part);
  });
  for (size_t i = 0; i < count; ++i) {
    const auto r = float(std::min(bounds[i], double(map.reach())));
    for (int axis = 0; axis < 3; ++axis) {
      boxes[i].low[axis] = std::max(points[i][axis] - r, -map.reach());
      boxes[i].high[axis] = std::min(points[i][axis] + r, map.reach());
    }
  }
  open(boxes);
  each("nearest", [&](Search& search, size_t i, const Eye& eye, Stats& part) {
    take(i, search.nearest(eye, bounds[i], part));
  });
  for (const Stats& part : parts) stats.tests += part;
  return stats;
}

Gathered RayMapNearest::estimate(const segments::SegmentSpan& segments, const Workers& workers,
                                 Progress* progress) const {
  RayMapStats stats;
  return estimate(segments, workers, progress, stats);
}

Gathered RayMapNearest::estimate(const segments::SegmentSpan& segments, const Workers& workers,
                                 Progress* progress, RayMapStats& stats) const {
  RayMapOptions tree = map_;
  // few of the segments that pass a leaf end there
  tree.ends_only = options_.metric == RayMetric::hit;
  RayMap map(rule_, tree);
  map.push(segments);
  Gathered out;
  out.irradiance.resize(3 * points_.size());
  std::vector<uint64_t> found(points_.size());
  const auto take = [&](size_t i, std::span<const NearRay> rays) {
    found[i] = rays.size();
    if (rays.empty() || rays.back().distance == 0) return;
    const double r = rays.back().distance, per_area = 1 / (std::numbers::pi * r * r);
    double sum[3] = {};
    for (const NearRay& ray : rays.first(rays.size() - (unbiased_ ? 1 : 0)))
      for (int c = 0; c < 3; ++c)
        sum[c] += ray.weight * double(segments.power[3 * size_t(ray.id) + size_t(c)]);
    for (int c = 0; c < 3; ++c) out.irradiance[3 * i + size_t(c)] = sum[c] * per_area;
  };
  const std::span power(segments.power, 3 * segments.count);
  stats = find_nearest(map, power, points_, normals_, options_, take, workers, progress);
  for (const uint64_t count : found) stats.tests.hits += count;
  out.stats = stats.tests;
  return out;
}

}  // namespace deltalux::estimate
