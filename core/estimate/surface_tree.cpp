// SPDX-License-Identifier: Apache-2.0
// Builds the tree by median splits of triangles' centroids; nearest points as in Ericson 2005,
// 5.1.5.
#include "estimate/surface_tree.h"

#include <algorithm>
#include <numeric>

#include "base/error.h"

namespace deltalux::estimate {

Vec3d nearest_point(const SurfaceTriangle& triangle, Vec3d p) {
  const auto& [a, b, c] = triangle.corner;
  const Vec3d ab = b - a, ac = c - a, ap = p - a;
  const double d1 = dot(ab, ap), d2 = dot(ac, ap);
  if (d1 <= 0 && d2 <= 0) return a;
  const Vec3d bp = p - b;
  const double d3 = dot(ab, bp), d4 = dot(ac, bp);
  if (d3 >= 0 && d4 <= d3) return b;
  const double vc = d1 * d4 - d3 * d2;
  if (vc <= 0 && d1 >= 0 && d3 <= 0) return a + ab * (d1 / (d1 - d3));
  const Vec3d cp = p - c;
  const double d5 = dot(ab, cp), d6 = dot(ac, cp);
  if (d6 >= 0 && d5 <= d6) return c;
  const double vb = d5 * d2 - d1 * d6;
  if (vb <= 0 && d2 >= 0 && d6 <= 0) return a + ac * (d2 / (d2 - d6));
  const double va = d3 * d6 - d5 * d4;
  if (va <= 0 && d4 - d3 >= 0 && d5 - d6 >= 0)
    return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
  const double all = va + vb + vc;
  return a + ab * (vb / all) + ac * (vc / all);
}

SurfaceTree::SurfaceTree(const double* corners, const uint32_t* surface, size_t count) {
  if (count >= kNoTriangle)
    throw OptionError("surfaces: found " + std::to_string(count) +
                      " triangles, expected fewer than 2^32 - 1");
  triangles_.resize(count);
  for (size_t i = 0; i < count; ++i) {
    SurfaceTriangle& t = triangles_[i];
    for (int k = 0; k < 3; ++k) {
      const double* p = corners + 9 * i + 3 * k;
      t.corner[k] = {p[0], p[1], p[2]};
    }
    const Vec3d twice = cross(t.corner[1] - t.corner[0], t.corner[2] - t.corner[0]);
    const double size = length(twice);
    if (!(size > 0))
      throw OptionError("surfaces: triangle " + std::to_string(i) +
                        " has no area, expected none such; leave it out");
    t.normal = twice * (1 / size);
    t.area = size / 2;
    t.surface = surface[i];
    surfaces_ = std::max(surfaces_, surface[i] + 1);
  }
  order_.resize(count);
  std::iota(order_.begin(), order_.end(), 0u);
  if (count == 0) return;
  nodes_.reserve(count + 1);
  nodes_.emplace_back();
  build(0, 0, uint32_t(count));
  diagonal_ = length(nodes_[0].high - nodes_[0].low);
}

void SurfaceTree::build(uint32_t node, uint32_t begin, uint32_t end) {
  Vec3d low = triangles_[order_[begin]].corner[0], high = low;
  const auto middle = [&](uint32_t i) {
    const auto& c = triangles_[i].corner;
    return c[0] + c[1] + c[2];
  };
  Vec3d least = middle(order_[begin]), most = least;  // of the sums of corners
  for (uint32_t k = begin; k < end; ++k) {
    for (const Vec3d& p : triangles_[order_[k]].corner) low = min(low, p), high = max(high, p);
    least = min(least, middle(order_[k])), most = max(most, middle(order_[k]));
  }
  nodes_[node].low = low, nodes_[node].high = high;
  if (end - begin <= 4) {
    nodes_[node].first = begin, nodes_[node].count = end - begin;
    return;
  }
  const Vec3d extent = most - least;
  const int axis =
      extent.x >= extent.y && extent.x >= extent.z ? 0 : (extent.y >= extent.z ? 1 : 2);
  const uint32_t half = begin + (end - begin) / 2;
  std::nth_element(order_.begin() + begin, order_.begin() + half, order_.begin() + end,
                   [&](uint32_t a, uint32_t b) { return middle(a)[axis] < middle(b)[axis]; });
  const uint32_t child = uint32_t(nodes_.size());
  nodes_[node].first = child;
  nodes_.resize(nodes_.size() + 2);
  build(child, begin, half);
  build(child + 1, half, end);
}

uint32_t SurfaceTree::nearest(Vec3d p, Vec3d facing, double least, double reach,
                              uint64_t* tests) const {
  uint64_t tested = 0;
  uint32_t best = kNoTriangle, stack[64], depth = 0;
  double best2 = reach * reach;
  if (!nodes_.empty()) stack[depth++] = 0;
  while (depth) {
    const Node& node = nodes_[stack[--depth]];
    if (!(distance2(node, p) <= best2)) continue;
    if (!node.count) {
      const bool second = distance2(nodes_[node.first + 1], p) < distance2(nodes_[node.first], p);
      stack[depth++] = node.first + (second ? 0 : 1);
      stack[depth++] = node.first + (second ? 1 : 0);
      continue;
    }
    for (uint32_t k = 0; k < node.count; ++k) {
      const uint32_t i = order_[node.first + k];
      if (!(dot(triangles_[i].normal, facing) > least)) continue;
      ++tested;
      const Vec3d gap = nearest_point(triangles_[i], p) - p;
      const double gap2 = dot(gap, gap);
      if (gap2 < best2 || (gap2 == best2 && i < best)) best2 = gap2, best = i;
    }
  }
  if (tests) *tests += tested;
  return best;
}

std::vector<uint32_t> SurfaceTree::landings(const segments::SegmentSpan& segments,
                                            const Workers& workers, Progress& progress,
                                            uint64_t* tests) const {
  constexpr size_t kGrain = 1024;
  std::vector<uint32_t> found(segments.count, kNoTriangle);
  std::vector<uint64_t> tested((segments.count + kGrain - 1) / kGrain);
  progress.begin("locate hits", segments.count);
  workers.for_blocks(segments.count, kGrain, [&](size_t begin, size_t end) {
    progress.check();
    for (size_t i = begin; i < end; ++i) {
      if (!std::isfinite(segments.length[i])) continue;
      const Vec3d back{-double(segments.dx[i]), -double(segments.dy[i]), -double(segments.dz[i])};
      found[i] =
          nearest(end_of(segments, i), back, 0, kEndTolerance * diagonal_, &tested[begin / kGrain]);
    }
    progress.advance(end - begin);
  });
  for (uint64_t count : tested)
    if (tests) *tests += count;
  return found;
}

}  // namespace deltalux::estimate
