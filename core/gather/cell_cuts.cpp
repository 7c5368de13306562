// SPDX-License-Identifier: Apache-2.0
// Finds what stands on a square and cuts the square there, so that light on one side of a wall does
// not count on the other.
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/random.h"
#include "gather/cell_builder.h"

namespace deltalux::gather {
namespace {

// All lengths in units of the edge.
constexpr double kHeight = 0.25;      // height above the square within which triangles are examined
constexpr double kStandsBelow = 0.1;  // triangles that begin higher let light through below
constexpr double kMinTrace = 0.15;    // shorter lines of contact hide little light
constexpr double kMinRise = 0.05;
constexpr double kMinPart = 0.01;  // cuts nearer to the square's border are ignored
constexpr double kSameLine = 0.01;
constexpr size_t kMaxCuts = 4;    // of a side
constexpr double kUpright = 0.2;  // sine of the smallest angle between square and triangle

struct VoxelHash {
  size_t operator()(const std::array<int64_t, 3>& v) const {
    return size_t(combine(combine(uint64_t(v[0]), uint64_t(v[1])), uint64_t(v[2])));
  }
};
using Voxels = std::unordered_map<std::array<int64_t, 3>, std::vector<uint32_t>, VoxelHash>;

/// A box of voxels.
struct Range {
  int64_t low[3], high[3];
  double count() const {
    double product = 1;
    for (int k = 0; k < 3; ++k) product *= double(high[k] - low[k] + 1);
    return product;
  }
  template <class Visit>
  void each(const Visit& visit) const {
    for (int64_t x = low[0]; x <= high[0]; ++x)
      for (int64_t y = low[1]; y <= high[1]; ++y)
        for (int64_t z = low[2]; z <= high[2]; ++z) visit(std::array{x, y, z});
  }
  bool holds(const std::array<int64_t, 3>& v) const {
    for (size_t k = 0; k < 3; ++k)
      if (v[k] < low[k] || v[k] > high[k]) return false;
    return true;
  }
};

/// Clips a polygon to the rectangle and to at most `height` above or below it.
Polygon within(Polygon polygon, const double (&low)[2], const double (&high)[2], double height) {
  polygon = clipped(polygon, [&](const Point& p) { return p.x - low[0]; });
  polygon = clipped(polygon, [&](const Point& p) { return high[0] - p.x; });
  polygon = clipped(polygon, [&](const Point& p) { return p.y - low[1]; });
  polygon = clipped(polygon, [&](const Point& p) { return high[1] - p.y; });
  polygon = clipped(polygon, [&](const Point& p) { return height - p.z; });
  return clipped(polygon, [&](const Point& p) { return height + p.z; });
}

/// The voxels that the bounding box of `points` overlaps.
Range voxels_of(std::span<const Vec3d> points, double padding, double edge) {
  Range out;
  for (int k = 0; k < 3; ++k) {
    double low = points[0][k], high = low;
    for (const Vec3d& p : points) low = std::min(low, p[k]), high = std::max(high, p[k]);
    out.low[k] = int64_t(std::floor((low - padding) / edge));
    out.high[k] = int64_t(std::floor((high + padding) / edge));
  }
  return out;
}

}  // namespace

void CellBuilder::find_cuts(const BodyCells& out) {
  cuts_.resize(squares_.size());
  // Use one grid per size of squares (in powers of two), so that large squares, as of a landscape,
  // occupy few voxels, too.
  std::map<int, Voxels> by_size;
  for (uint32_t i = 0; i < squares_.size(); ++i) {
    const Square& square = squares_[i];
    const BodyCells::Patch& patch = out.patches_[square.patch];
    Vec3d corners[4];
    for (int k = 0; k < 4; ++k)
      corners[k] = Vec3d(patch.origin) + Vec3d(patch.u) * (k & 1 ? square.high[0] : square.low[0]) +
                   Vec3d(patch.v) * (k & 2 ? square.high[1] : square.low[1]);
    const double longest = std::max(square.high[0] - square.low[0], square.high[1] - square.low[1]);
    const int size = std::max(0, std::ilogb(longest / edge_));
    voxels_of(corners, kHeight * edge_, std::ldexp(edge_, size)).each([&](const auto& voxel) {
      by_size[size][voxel].push_back(i);
    });
  }
  std::vector<uint32_t> seen(squares_.size(), kNoCell);
  for (uint32_t t = 0; t < triangles_.size(); ++t) {
    if (out.faces_[t].normal == Vec3f{} || longest_edge(t) < kMinTrace * edge_) continue;
    const auto visit = [&](const std::vector<uint32_t>& near) {
      for (uint32_t square : near)
        if (std::exchange(seen[square], t) != t) try_cut(out, t, square);
    };
    const Vec3d corners[3] = {corner(t, 0), corner(t, 1), corner(t, 2)};
    for (const auto& [size, voxels] : by_size) {
      const Range range = voxels_of(corners, 0, std::ldexp(edge_, size));
      if (range.count() > double(voxels.size())) {
        for (const auto& [voxel, near] : voxels)
          if (range.holds(voxel)) visit(near);
      } else {
        range.each([&](const auto& voxel) {
          if (const auto found = voxels.find(voxel); found != voxels.end()) visit(found->second);
        });
      }
    }
  }
  for (auto& sides : cuts_)
    for (std::vector<Cut>& cuts : sides) {
      std::sort(cuts.begin(), cuts.end(), [](const Cut& p, const Cut& q) {
        return std::tie(q.weight, p.a, p.b, p.c) < std::tie(p.weight, q.a, q.b, q.c);
      });
      if (cuts.size() > kMaxCuts) cuts.resize(kMaxCuts);
    }
}

void CellBuilder::try_cut(const BodyCells& out, uint32_t triangle, uint32_t number) {
  const Square& square = squares_[number];
  if (out.faces_[triangle].patch == square.patch) return;
  const BodyCells::Patch& patch = out.patches_[square.patch];
  const Vec3d u(patch.u), v(patch.v), up = cross(u, v);
  const Vec3d normal = normalize(across(triangle));
  const double across_u = dot(normal, u), across_v = dot(normal, v);
  const double sine = std::sqrt(across_u * across_u + across_v * across_v);
  if (sine < kUpright) return;
  const double height = kHeight * edge_;
  Point corners[3];
  for (int k = 0; k < 3; ++k) {
    const Vec3d d = corner(triangle, k) - Vec3d(patch.origin);
    corners[k] = {dot(d, u), dot(d, v), dot(d, up)};
  }
  const auto outside = [&](double Point::* axis, double low, double high) {
    const auto [least, most] = std::minmax({corners[0].*axis, corners[1].*axis, corners[2].*axis});
    return most < low || least > high;
  };
  if (outside(&Point::x, square.low[0], square.high[0]) ||
      outside(&Point::y, square.low[1], square.high[1]) || outside(&Point::z, -height, height))
    return;
  const Polygon stands =
      within({corners[0], corners[1], corners[2]}, square.low, square.high, height);
  if (stands.size() < 3) return;
  // The line where the triangle's plane meets the square's: a x + b y = c.
  const Vec3d d = corner(triangle, 0) - Vec3d(patch.origin);
  Cut cut{across_u / sine, across_v / sine, dot(normal, d) / sine, 0};
  if (cut.a < 0 || (cut.a == 0 && cut.b < 0)) cut.a = -cut.a, cut.b = -cut.b, cut.c = -cut.c;
  double least = 0, most = 0;
  for (const Polygon& piece : square.pieces)
    for (const Point& p : piece) {
      const double off = cut.a * p.x + cut.b * p.y - cut.c;
      least = std::min(least, off), most = std::max(most, off);
    }
  if (least > -kMinPart * edge_ || most < kMinPart * edge_) return;
  for (int side = 0; side < 2; ++side) {
    const double sign = side ? -1 : 1;
    const Polygon above = clipped(stands, [&](const Point& p) { return sign * p.z; });
    if (above.size() < 3) continue;
    double low = height, high = 0, from = 1e300, to = -1e300;
    for (const Point& p : above) {
      low = std::min(low, sign * p.z), high = std::max(high, sign * p.z);
      const double along = -cut.b * p.x + cut.a * p.y;
      from = std::min(from, along), to = std::max(to, along);
    }
    if (low > kStandsBelow * edge_ || high - low < kMinRise * edge_ ||
        to - from < kMinTrace * edge_)
      continue;
    cut.weight = (to - from) * (high - low);
    add_cut(cuts_[number][size_t(side)], cut);
  }
}

void CellBuilder::add_cut(std::vector<Cut>& cuts, const Cut& cut) const {
  const auto same = std::find_if(cuts.begin(), cuts.end(), [&](const Cut& other) {
    return std::fabs(other.a - cut.a) + std::fabs(other.b - cut.b) < kSameLine &&
           std::fabs(other.c - cut.c) < kSameLine * edge_;
  });
  if (same == cuts.end())
    cuts.push_back(cut);
  else
    same->weight += cut.weight;
}

}  // namespace deltalux::gather
