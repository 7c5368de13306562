// SPDX-License-Identifier: Apache-2.0
// Region queries of a ray map: segments that meet a sphere or a box.
#include "estimate/ray_map/region.h"

#include <algorithm>
#include <mutex>

namespace deltalux::estimate {
namespace {

bool meets_sphere(const RayRecord& r, Vec3d centre, double radius) {
  const Vec3d o(r.origin), w(r.direction);
  const double t = std::clamp(dot(centre - o, w) / dot(w, w), 0.0, double(r.length));
  const Vec3d away = o + w * t - centre;
  return dot(away, away) <= radius * radius;
}

bool meets_box(const RayRecord& r, const Box& box) {
  double enter = 0, leave = r.length;
  for (int axis = 0; axis < 3; ++axis) {
    const double o = r.origin[axis], w = r.direction[axis];
    const double low = box.low[axis], high = box.high[axis];
    if (w == 0) {
      if (o < low || o > high) return false;
      continue;
    }
    const double a = (low - o) / w, b = (high - o) / w;
    enter = std::max(enter, std::min(a, b)), leave = std::min(leave, std::max(a, b));
  }
  return enter <= leave;
}

template <class Meets>
std::vector<uint32_t> find(RayMap& map, const Box& around, const Meets& meets, RayMapStats& stats) {
  std::vector<uint32_t> found;
  const auto test = [&](std::span<const uint32_t> ids) {
    for (const uint32_t id : ids)
      if (map.record(id).alive() && meets(map.record(id))) found.push_back(id);
  };
  stats = map.visit(
      std::span(&around, 1), {},
      [&](const RayMap::Leaf& leaf) {
        test(leaf.ids);
        return Stats{.sphere_tests = leaf.ids.size()};
      },
      Workers(1));
  map.odd().for_range(0, test);
  stats.tests.sphere_tests += map.odd().count();
  // A segment is listed in every leaf that it passes.
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  stats.tests.hits = found.size();
  return found;
}

}  // namespace

std::vector<uint32_t> find_in_sphere(RayMap& map, Vec3f centre, float radius, RayMapStats& stats) {
  const Box around = Box{centre, centre}.padded(radius);
  const auto meets = [&](const RayRecord& r) {
    return meets_sphere(r, Vec3d(centre), double(radius));
  };
  return find(map, around, meets, stats);
}

std::vector<uint32_t> find_in_box(RayMap& map, const Box& box, RayMapStats& stats) {
  return find(map, box, [&](const RayRecord& r) { return meets_box(r, box); }, stats);
}

}  // namespace deltalux::estimate
