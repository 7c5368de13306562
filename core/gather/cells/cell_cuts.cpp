// SPDX-License-Identifier: Apache-2.0
// Finds what stands on a square and cuts the square there, so that light on one side of a wall does
// not count on the other.
#include <algorithm>
#include <array>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/random.h"
#include "gather/cells/cell_builder.h"

namespace deltalux::gather {
namespace {

// All lengths in units of the edge.
constexpr double kHeight = 0.25;      // height above the square within which triangles are examined
constexpr double kStandsBelow = 0.1;  // triangles that begin higher let light through below
constexpr double kMinTrace = 0.15;    // shorter lines of contact hide little light
constexpr double kMinRise = 0.05;
constexpr double kMinPart = 0.01;  // cuts nearer to the square's border are ignored
constexpr double kSameLine = 0.01;
constexpr size_t kMaxCuts = 4;  // of a side
constexpr double kFar = std::numeric_limits<double>::infinity();
// A shorter one, too, is a cut if it is this share of the line across the square or clump: at a
// corner, where that is short, or where a wall ends.
constexpr double kMinShare = 0.05;
constexpr double kUpright = 0.2;  // sine of the smallest angle between square and triangle

struct VoxelHash {
  size_t operator()(const std::array<int64_t, 3>& v) const {
    return size_t(combine(combine(uint64_t(v[0]), uint64_t(v[1])), uint64_t(v[2])));
  }
};
using Voxels = std::unordered_map<std::array<int64_t, 3>, std::vector<uint32_t>, VoxelHash>;

/// A box in space.
struct Box3 {
  Vec3d low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  Box3(std::span<const Vec3d> points, double padding) {
    for (int k = 0; k < 3; ++k) {
      for (const Vec3d& p : points)
        low[k] = std::min(low[k], p[k]), high[k] = std::max(high[k], p[k]);
      low[k] -= padding, high[k] += padding;
    }
  }
  double longest() const {
    const Vec3d e = high - low;
    return std::max({e.x, e.y, e.z});
  }
};

/// A box of voxels.
struct Range {
  int64_t low[3], high[3];
  template <class Visit>
  void each(const Visit& visit) const {
    for (int64_t x = low[0]; x <= high[0]; ++x)
      for (int64_t y = low[1]; y <= high[1]; ++y)
        for (int64_t z = low[2]; z <= high[2]; ++z) visit(std::array{x, y, z});
  }
};

/// Clips a polygon to the rectangle and to at most `height` above or below it.
Polygon within(Polygon polygon, const std::array<double, 2>& low, const std::array<double, 2>& high,
               double height) {
  polygon = clipped(polygon, [&](const Point& p) { return p.x - low[0]; });
  polygon = clipped(polygon, [&](const Point& p) { return high[0] - p.x; });
  polygon = clipped(polygon, [&](const Point& p) { return p.y - low[1]; });
  polygon = clipped(polygon, [&](const Point& p) { return high[1] - p.y; });
  polygon = clipped(polygon, [&](const Point& p) { return height - p.z; });
  return clipped(polygon, [&](const Point& p) { return height + p.z; });
}

/// Whether the plane through `at` has corners of the box on both sides.
bool crosses(const Box& box, const Vec3d& normal, const Vec3d& at) {
  const Vec3d low(box.low), high(box.high), half = (high - low) * 0.5;
  double reach = 0;
  for (int k = 0; k < 3; ++k) reach += std::fabs(normal[k]) * half[k];
  return std::fabs(dot(normal, low + half - at)) < reach;
}

/// The extent of the line where a plane cuts convex shapes.
struct Chord {
  /// A corner of a shape: its distance from the plane, and its coordinate along the line.
  struct Corner {
    double off, along;
  };
  double from = kFar, to = -kFar;
  template <size_t N>
  void grow(const std::array<Corner, N>& shape) {
    for (size_t i = 0; i < N; ++i) {
      const Corner &p = shape[i], &q = shape[(i + 1) % N];
      if ((p.off > 0) == (q.off > 0)) continue;
      const double at = p.along + (q.along - p.along) * p.off / (p.off - q.off);
      from = std::min(from, at), to = std::max(to, at);
    }
  }
  double length() const { return to - from; }
};

/// Things in space: one grid per size (in powers of two), so that large ones, as of a landscape,
/// occupy few voxels, too.
class Grids {
 public:
  explicit Grids(double edge) : edge_(edge) {}
  int size_of(double longest) const { return std::max(0, std::ilogb(longest / edge_)); }
  void add(uint32_t thing, int size, const Box3& box) {
    range(box, size).each([&](const auto& voxel) { by_size_[size][voxel].push_back(thing); });
  }
  /// Calls visit(thing) for the things of at least the size `least` near a box; several times for
  /// some.
  template <class Visit>
  void each_near(const Box3& box, int least, const Visit& visit) const {
    for (auto own = by_size_.lower_bound(least); own != by_size_.end(); ++own)
      range(box, own->first).each([&](const auto& voxel) {
        const auto found = own->second.find(voxel);
        if (found == own->second.end()) return;
        for (const uint32_t thing : found->second) visit(thing);
      });
  }

 private:
  /// The voxels that the box overlaps.
  Range range(const Box3& box, int size) const {
    const double edge = std::ldexp(edge_, size);
    Range out;
    for (int k = 0; k < 3; ++k) {
      out.low[k] = int64_t(std::floor(box.low[k] / edge));
      out.high[k] = int64_t(std::floor(box.high[k] / edge));
    }
    return out;
  }

  double edge_;
  std::map<int, Voxels> by_size_;
};

}  // namespace

CellBuilder::Standing CellBuilder::standing_of(const Polygon& above, double up, double a,
                                               double b) {
  Standing out{kFar, -kFar, kFar, -kFar};
  for (const Point& p : above) {
    const double along = -b * p.x + a * p.y;
    out.grow({up * p.z, up * p.z, along, along});
  }
  return out;
}

std::array<Vec3d, 4> CellBuilder::corners_of(const BodyCells& out, uint32_t number) const {
  if (number >= squares_.size()) {
    const Box& box = clumps_[number - squares_.size()].box;
    return {Vec3d(box.low), Vec3d(box.low), Vec3d(box.high), Vec3d(box.high)};
  }
  const Square& square = squares_[number];
  const BodyCells::Patch& patch = out.patches_[square.patch];
  std::array<Vec3d, 4> corners;
  for (size_t k = 0; k < 4; ++k)
    corners[k] = Vec3d(patch.origin) + Vec3d(patch.u) * (k & 1 ? square.high[0] : square.low[0]) +
                 Vec3d(patch.v) * (k & 2 ? square.high[1] : square.low[1]);
  return corners;
}

void CellBuilder::find_cuts(const BodyCells& out) {
  cuts_.resize(squares_.size());
  const uint32_t count = uint32_t(squares_.size() + clumps_.size());
  const auto box_of_triangle = [&](uint32_t t) {
    return Box3(std::array{corner(t, 0), corner(t, 1), corner(t, 2)}, 0);
  };
  const auto is_small = [&](uint32_t t) { return out.faces_[t].patch == kNoCell; };
  const auto may_cut = [&](uint32_t t) {
    return out.faces_[t].normal != Vec3f{} &&
           (!is_small(t) || longest_edge(t) >= kMinTrace * edge_);
  };
  // Triangles look for squares and clumps of their size or larger, and these for triangles that are
  // larger than they are.
  Grids wide(edge_), triangles(edge_);
  for (uint32_t t = 0; t < triangles_.size(); ++t) {
    if (!may_cut(t)) continue;
    const Box3 box = box_of_triangle(t);
    if (const int size = triangles.size_of(box.longest())) triangles.add(t, size, box);
  }
  std::vector<std::vector<uint32_t>> below(triangles_.size());  // squares and clumps, by triangle
  for (uint32_t i = 0; i < count; ++i) {
    step();
    const Box3 box(corners_of(out, i), kHeight * edge_);
    const int size = wide.size_of(box.longest());
    wide.add(i, size, box);
    triangles.each_near(box, size + 1, [&](uint32_t t) {
      if (below[t].empty() || below[t].back() != i) below[t].push_back(i);
    });
  }
  std::vector<uint32_t> seen(count, kNoCell);
  for (uint32_t t = 0; t < triangles_.size(); ++t) {
    if (!may_cut(t)) continue;
    const auto visit = [&](uint32_t number) {
      if (std::exchange(seen[number], t) == t) return;
      step();
      if (number < squares_.size())
        try_cut(out, t, number);
      else if (!is_small(t))
        try_clump(out, t, number - uint32_t(squares_.size()));
    };
    for (const uint32_t number : std::exchange(below[t], {})) visit(number);
    const Box3 box = box_of_triangle(t);
    wide.each_near(box, wide.size_of(box.longest()), visit);
  }
  cut_by_planes();
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
      within({corners[0], corners[1], corners[2]}, {square.low[0], square.low[1]},
             {square.high[0], square.high[1]}, height);
  if (stands.size() < 3) return;
  // The line where the triangle's plane meets the square's: a x + b y = c.
  const Vec3d d = corner(triangle, 0) - Vec3d(patch.origin);
  Cut cut{across_u / sine, across_v / sine, dot(normal, d) / sine, 0};
  if (cut.a < 0 || (cut.a == 0 && cut.b < 0)) cut.a = -cut.a, cut.b = -cut.b, cut.c = -cut.c;
  const auto off = [&](const Point& p) { return cut.a * p.x + cut.b * p.y - cut.c; };
  double least = 0, most = 0;
  for (const Piece& piece : square.pieces)
    for (const Point& p : piece.shape)
      least = std::min(least, off(p)), most = std::max(most, off(p));
  if (least > -kMinPart * edge_ || most < kMinPart * edge_) return;
  const auto at = [&](size_t i, size_t k) {
    const Point p{i ? square.high[0] : square.low[0], k ? square.high[1] : square.low[1]};
    return Chord::Corner{off(p), cut.a * p.y - cut.b * p.x};
  };
  Chord chord;
  chord.grow<4>({at(0, 0), at(1, 0), at(1, 1), at(0, 1)});
  for (int side = 0; side < 2; ++side) {
    const double sign = side ? -1 : 1;
    const Polygon above = clipped(stands, [&](const Point& p) { return sign * p.z; });
    if (above.size() < 3) continue;
    const Standing standing = standing_of(above, sign, cut.a, cut.b);
    if (cuts_by_itself(standing, 0, chord.length())) {
      cut.weight = standing.area();
      add_cut(cuts_[number][size_t(side)], cut);
    } else if (const uint32_t plane = out.faces_[triangle].patch; plane != kNoCell) {
      const auto [entry, fresh] = stands_.try_emplace({number, uint32_t(side), plane},
                                                      Stand{standing, cut, {}, 0, chord.length()});
      if (!fresh) entry->second.standing.grow(standing);
    }
  }
}

void CellBuilder::try_clump(const BodyCells& out, uint32_t triangle, uint32_t number) {
  const Clump& clump = clumps_[number];
  const Vec3d up = normalize(clump.across), normal = normalize(across(triangle));
  const Vec3d level = normal - up * dot(normal, up);
  const double sine = length(level);
  if (sine < kUpright || !crosses(clump.box, normal, corner(triangle, 0))) return;
  // x runs across the plane, y along the line of contact, z upwards.
  const Vec3d x = level * (1 / sine), y = cross(up, x), base = corner(clump.triangles[0], 0);
  const auto local = [&](const Vec3d& p) {
    return Point{dot(p - base, x), dot(p - base, y), dot(p - base, up)};
  };
  Point low{kFar, kFar, kFar}, high{-kFar, -kFar, -kFar};
  PlaneCut cut{normal, dot(normal, corner(triangle, 0)), 0};
  if (std::tie(normal.x, normal.y, normal.z) < std::tuple{0.0, 0.0, 0.0})
    cut = {-cut.normal, -cut.offset, 0};
  double least = 0, most = 0;
  Chord chord;
  for (const uint32_t t : clump.triangles) {
    std::array<Chord::Corner, 3> corners;
    for (int k = 0; k < 3; ++k) {
      const Point p = local(corner(t, k));
      low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
      const double off = dot(cut.normal, corner(t, k)) - cut.offset;
      least = std::min(least, off), most = std::max(most, off);
      corners[size_t(k)] = {off, p.y};
    }
    chord.grow(corners);
  }
  if (least > -kMinPart * edge_ || most < kMinPart * edge_) return;
  const double height = kHeight * edge_, relief = high.z - low.z;
  const Polygon whole{local(corner(triangle, 0)), local(corner(triangle, 1)),
                      local(corner(triangle, 2))};
  for (uint32_t side = 0; side < 2; ++side) {
    const double sign = side ? -1 : 1, foot = side ? high.z : low.z;
    Polygon above;
    for (Point p : whole) p.z = sign * (p.z - foot), above.push_back(p);
    above = clipped(above, [&](const Point& p) { return p.z; });
    above = within(above, {low.x, low.y}, {high.x, high.y}, relief + height);
    if (above.size() < 3) continue;
    const auto [entry, fresh] =
        stands_.try_emplace({uint32_t(squares_.size()) + number, side, out.faces_[triangle].patch},
                            Stand{standing_of(above, 1, 1, 0), {}, cut, relief, chord.length()});
    if (!fresh) entry->second.standing.grow(standing_of(above, 1, 1, 0));
  }
}

bool CellBuilder::cuts_by_itself(const Standing& standing, double relief, double chord) const {
  return standing.low <= relief + kStandsBelow * edge_ &&
         standing.high - standing.low >= kMinRise * edge_ &&
         standing.to - standing.from >= std::min(kMinTrace * edge_, kMinShare * chord);
}

void CellBuilder::cut_by_planes() {
  for (auto& [key, stand] : stands_) {
    if (!cuts_by_itself(stand.standing, stand.relief, stand.chord)) continue;
    const auto [number, side, patch] = key;
    if (number < squares_.size()) {
      stand.cut.weight = stand.standing.area();
      add_cut(cuts_[number][side], stand.cut);
    } else {
      stand.plane.weight = stand.standing.area();
      add_cut(clumps_[number - squares_.size()].cuts[side], stand.plane);
    }
  }
  stands_.clear();
  for (Clump& clump : clumps_)
    for (std::vector<PlaneCut>& cuts : clump.cuts) {
      std::stable_sort(cuts.begin(), cuts.end(),
                       [](const PlaneCut& p, const PlaneCut& q) { return p.weight > q.weight; });
      if (cuts.size() > kMaxCuts) cuts.resize(kMaxCuts);
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

void CellBuilder::add_cut(std::vector<PlaneCut>& cuts, const PlaneCut& cut) const {
  const auto same = std::find_if(cuts.begin(), cuts.end(), [&](const PlaneCut& other) {
    return length(other.normal - cut.normal) < kSameLine &&
           std::fabs(other.offset - cut.offset) < kSameLine * edge_;
  });
  if (same == cuts.end())
    cuts.push_back(cut);
  else
    same->weight += cut.weight;
}

}  // namespace deltalux::gather
