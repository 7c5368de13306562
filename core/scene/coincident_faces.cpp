// SPDX-License-Identifier: Apache-2.0
// Candidates come from grids of voxels, one for each size of faces.
#include "scene/coincident_faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "base/random.h"

namespace deltalux::scene {
namespace {

constexpr double kParallel = 0.9995;  // cosine: normals of faces in one plane differ by less
// in units of position_slack(): rays cannot tell faces apart that are nearer to each other
constexpr float kTogether = 0.5f;
constexpr double kOverlap = 4;  // in units of position_slack(): those that overlap by less touch
constexpr int kMaxLevels = 32;  // between the smallest faces and the largest

/// What the search reads of a face.
struct Plane {
  Vec3d corner[3], normal;  ///< unit; zero for a face without area
  Box box;
  double slack;  ///< position_slack() of the corners
  int level;     ///< the face's extent is at least 2^level and below 2^(level + 1)
};

Plane plane_of(const Face& face) {
  Plane own{};
  for (int k = 0; k < 3; ++k) {
    own.corner[k] = Vec3d(face.corner[k]);
    own.box.grow(face.corner[k]);
    own.slack = std::max(own.slack, double(position_slack(face.corner[k])));
  }
  const Vec3d n = cross(own.corner[1] - own.corner[0], own.corner[2] - own.corner[0]);
  const double twice = length(n);
  if (twice > 0 && std::isfinite(1 / twice)) own.normal = n * (1 / twice);
  const Vec3f e = own.box.extent();
  own.level = std::ilogb(std::max({e.x, e.y, e.z, std::numeric_limits<float>::min()}));
  return own;
}

/// Whether the projections of two faces on the plane of `a` overlap by more than `least`.
bool overlap(const Plane& a, const Plane& b, double least) {
  const auto part = [&](const Plane& one, const Plane& other) {
    for (int k = 0; k < 3; ++k) {
      const Vec3d from = one.corner[k];
      const Vec3d outward = normalize(cross(one.corner[(k + 1) % 3] - from, one.normal));
      double nearest = std::numeric_limits<double>::infinity();
      for (const Vec3d& p : other.corner) nearest = std::min(nearest, dot(outward, p - from));
      if (nearest > -least) return true;
    }
    return false;
  };
  return !part(a, b) && !part(b, a);
}

using Voxel = std::array<int64_t, 3>;
struct VoxelHash {
  size_t operator()(const Voxel& v) const {
    return size_t(combine(combine(uint64_t(v[0]), uint64_t(v[1])), uint64_t(v[2])));
  }
};

/// Calls visit(voxel) for the voxels of edge length 2^(level + 1) that the padded box meets.
template <class Visit>
void each_voxel(const Box& box, double padding, int level, const Visit& visit) {
  Voxel low, high;
  const double per_edge = std::ldexp(1.0, -level - 1);
  for (size_t k = 0; k < 3; ++k) {
    low[k] = int64_t(std::floor((double(box.low[int(k)]) - padding) * per_edge));
    high[k] = int64_t(std::floor((double(box.high[int(k)]) + padding) * per_edge));
  }
  for (int64_t x = low[0]; x <= high[0]; ++x)
    for (int64_t y = low[1]; y <= high[1]; ++y)
      for (int64_t z = low[2]; z <= high[2]; ++z) visit(Voxel{x, y, z});
}

/// Finds the pairs, each with its smaller face first.
class Search {
 public:
  Search(std::span<const Face> faces, float within) : faces_(faces), within_(double(within)) {
    planes_.reserve(faces.size());
    for (const Face& face : faces) planes_.push_back(plane_of(face));
    order_.resize(faces.size());
    std::iota(order_.begin(), order_.end(), 0u);
    std::erase_if(order_, [&](uint32_t i) { return planes_[i].normal == Vec3d{}; });
    if (order_.empty()) return;
    const auto larger = [&](uint32_t a, uint32_t b) {
      return std::pair{planes_[b].level, a} < std::pair{planes_[a].level, b};
    };
    std::sort(order_.begin(), order_.end(), larger);
    const int least = planes_[order_[0]].level - kMaxLevels;
    for (const uint32_t i : order_) planes_[i].level = std::max(planes_[i].level, least);
  }
  /// Calls visit(one, other, whether they lie in one plane, height of `one` above `other`).
  template <class Visit>
  void each_pair(const Visit& visit) {
    std::vector<uint32_t> seen(faces_.size(), ~0u);
    std::vector<std::pair<int, Grid>> grids;  // from large to small
    for (const uint32_t one : order_) {
      const Plane& own = planes_[one];
      for (const auto& [level, grid] : grids)
        each_voxel(own.box, reach(own), level, [&](const Voxel& voxel) {
          const auto found = grid.find(voxel);
          if (found == grid.end()) return;
          for (const uint32_t other : found->second)
            if (std::exchange(seen[other], one) != one) compare(one, other, visit);
        });
      if (grids.empty() || grids.back().first != own.level) grids.emplace_back(own.level, Grid{});
      each_voxel(own.box, 0, own.level,
                 [&](const Voxel& voxel) { grids.back().second[voxel].push_back(one); });
    }
  }

 private:
  using Grid = std::unordered_map<Voxel, std::vector<uint32_t>, VoxelHash>;

  /// Faces farther apart than their extent are not examined.
  double reach(const Plane& face) const { return std::min(within_, std::ldexp(1.0, face.level)); }
  template <class Visit>
  void compare(uint32_t one, uint32_t other, const Visit& visit) const {
    const Plane &a = planes_[one], &b = planes_[other];
    if (std::fabs(dot(a.normal, b.normal)) < kParallel) return;
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (const Vec3d& p : a.corner) {
      const double height = dot(b.normal, p - b.corner[0]);
      low = std::min(low, height), high = std::max(high, height);
    }
    const double middle = 0.5 * (low + high), together = double(kTogether) * a.slack;
    const bool same = std::max(std::fabs(low), std::fabs(high)) <= together;
    if (!same && std::fabs(middle) > reach(a)) return;
    if (overlap(b, a, kOverlap * a.slack)) visit(one, other, same, middle);
  }

  std::span<const Face> faces_;
  double within_;
  std::vector<Plane> planes_;
  std::vector<uint32_t> order_;  // large faces first
};

/// Smaller values hide larger ones in the same plane.
auto rank(const Face& face, uint32_t number, bool back) {
  return std::tuple{back && !face.two_sided, !face.emits, !face.two_sided, number};
}

}  // namespace

CoincidentFaces::CoincidentFaces(std::span<const Face> faces, float within) {
  std::vector<std::pair<uint32_t, Hider>> found;
  Search(faces, within).each_pair([&](uint32_t one, uint32_t other, bool same, double height) {
    const auto normal = [&](uint32_t i) {
      const Vec3f* p = faces[i].corner;
      return cross(Vec3d(p[1]) - Vec3d(p[0]), Vec3d(p[2]) - Vec3d(p[0]));
    };
    const bool turned = dot(normal(one), normal(other)) < 0;
    // `back`: as seen from the side that `other` calls its back.
    for (const bool back : {false, true}) {
      const bool one_wins =
          same ? rank(faces[one], one, back != turned) < rank(faces[other], other, back)
               : (height > 0) != back;
      const uint32_t hidden = one_wins ? other : one, hider = one_wins ? one : other;
      if (!faces[hider].opaque) continue;
      const bool from_back = hidden == other ? back : back != turned;
      found.push_back({hidden, {hider, same ? 0.0f : float(std::fabs(height)), from_back}});
    }
  });
  if (found.empty()) return;
  std::sort(found.begin(), found.end(), [](const auto& a, const auto& b) {
    return std::tuple{a.first, a.second.face, a.second.from_back} <
           std::tuple{b.first, b.second.face, b.second.from_back};
  });
  begin_.assign(faces.size() + 1, 0);
  for (const auto& [hidden, hider] : found) {
    ++begin_[hidden + 1];
    hiders_.push_back(hider);
  }
  std::partial_sum(begin_.begin(), begin_.end(), begin_.begin());
}

}  // namespace deltalux::scene
