// SPDX-License-Identifier: Apache-2.0
// The surfaces that light falls on, as one-sided triangles in a bounding volume hierarchy. Finds
// the triangles in a sphere, and the triangle on which a segment ends.
#pragma once
#include <cstdint>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/vec.h"
#include "segments/segment_span.h"

namespace deltalux::estimate {

inline constexpr uint32_t kNoTriangle = 0xffffffffu;

/// A triangle, visible from the side where its corners are counter-clockwise.
struct SurfaceTriangle {
  Vec3d corner[3];
  Vec3d normal;  ///< unit length
  double area = 0;
  uint32_t surface = 0;  ///< triangles of one surface continue each other
};

/// The first hit of a segment, in double precision.
inline Vec3d end_of(const segments::SegmentSpan& s, size_t i) {
  const double t = s.length[i];
  return {double(s.ox[i]) + t * double(s.dx[i]), double(s.oy[i]) + t * double(s.dy[i]),
          double(s.oz[i]) + t * double(s.dz[i])};
}

/// The point of a triangle nearest to `p`.
Vec3d nearest_point(const SurfaceTriangle& triangle, Vec3d p);

class SurfaceTree {
 public:
  /// `corners`: 9 numbers per triangle; none may be degenerate. Throws OptionError.
  SurfaceTree(const double* corners, const uint32_t* surface, size_t count);

  const std::vector<SurfaceTriangle>& triangles() const { return triangles_; }
  uint32_t surfaces() const { return surfaces_; }
  /// Diagonal of the bounding box of all triangles.
  double diagonal() const { return diagonal_; }

  /// The triangle nearest to `p`, at most `reach` away, with normal . facing > least; the first one
  /// of those equally near; kNoTriangle if there is none. If `tests` is given, adds the number of
  /// triangles whose distance was computed.
  uint32_t nearest(Vec3d p, Vec3d facing, double least, double reach,
                   uint64_t* tests = nullptr) const;
  /// The triangle on whose front side each segment ends, within a tolerance of kEndTolerance of the
  /// diagonal; kNoTriangle for endless segments and those that end in free space.
  std::vector<uint32_t> landings(const segments::SegmentSpan& segments, const Workers& workers,
                                 Progress& progress, uint64_t* tests = nullptr) const;
  static constexpr double kEndTolerance = 2e-5;

  /// Calls visit(index) for all triangles that reach into the sphere, and for some others.
  template <class Visit>
  void near(Vec3d centre, double radius, Visit&& visit) const {
    uint32_t stack[64], depth = 0;
    if (!nodes_.empty()) stack[depth++] = 0;
    while (depth) {
      const Node& node = nodes_[stack[--depth]];
      if (!(distance2(node, centre) <= radius * radius)) continue;
      if (node.count) {
        for (uint32_t k = 0; k < node.count; ++k) visit(order_[node.first + k]);
      } else {
        stack[depth++] = node.first + 1, stack[depth++] = node.first;
      }
    }
  }

 private:
  struct Node {
    Vec3d low, high;
    uint32_t first = 0, count = 0;  ///< count 0: children are nodes first and first + 1
  };
  static double distance2(const Node& node, Vec3d p) {
    const Vec3d gap = max(node.low, min(p, node.high)) - p;
    return dot(gap, gap);
  }
  void build(uint32_t node, uint32_t begin, uint32_t end);

  std::vector<SurfaceTriangle> triangles_;
  std::vector<uint32_t> order_;
  std::vector<Node> nodes_;
  double diagonal_ = 0;
  uint32_t surfaces_ = 0;
};

}  // namespace deltalux::estimate
