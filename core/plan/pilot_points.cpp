// SPDX-License-Identifier: Apache-2.0
// Draws points on surfaces by area, from samples, and by rays from samples.
#include "plan/pilot_points.h"

#include <algorithm>
#include <array>
#include <utility>
#include <vector>

#include "base/random.h"
#include "direct/light_shape.h"
#include "trace/scatter.h"

namespace deltalux::plan {
namespace {

// Independent of the session's seed, so that the result holds for every seed.
constexpr uint64_t kSeed = 20070129, kLandSeed = 20261127;
constexpr float kRadius = 0.15f;   // scene metres
constexpr uint32_t kAnywhere = 4;  // one of so many points lies anywhere

}  // namespace

samples::SampleSet surface_points(const scene::Scene& scene, float radius, uint32_t count) {
  std::vector<double> cumulative;
  std::vector<std::array<Vec3f, 3>> corners;
  cumulative.reserve(scene.static_primitives());
  corners.reserve(scene.static_primitives());
  double area = 0;
  for (const scene::Object& object : scene.objects) {
    if (object.movable) continue;
    const std::vector<Vec3f> world = object.world_vertices();
    for (const auto& t : object.triangles) {
      const std::array<Vec3f, 3> p{world[t[0]], world[t[1]], world[t[2]]};
      const double own = 0.5 * length(cross(Vec3d(p[1] - p[0]), Vec3d(p[2] - p[0])));
      if (!(own > 0)) continue;
      cumulative.push_back(area += own);
      corners.push_back(p);
    }
  }
  samples::SampleSet set;
  const PathRandom random(kSeed, 0);
  for (uint32_t i = 0; i < count && !corners.empty(); ++i) {
    const double share = (double(i / 2) + double(random(i, 0))) / (0.5 * (count + 1));
    const size_t by_area = size_t(
        std::upper_bound(cumulative.begin(), cumulative.end(), share * area) - cumulative.begin());
    const size_t k =
        std::min(i % 2 ? by_area : size_t(share * double(corners.size())), corners.size() - 1);
    float u = random(i, 1), v = random(i, 2);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const auto& p = corners[k];
    set.point.push_back(p[0] + (p[1] - p[0]) * u + (p[2] - p[0]) * v);
    set.normal.push_back(Vec3f(normalize(cross(Vec3d(p[1] - p[0]), Vec3d(p[2] - p[0])))));
  }
  set.radius.assign(set.size(), radius);
  set.attached.assign(set.size(), scene::kNone);
  return set;
}

samples::SampleSet pilot_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                const samples::SampleSet& samples, float metre, uint32_t count) {
  const float radius = kRadius * metre;
  std::vector<std::pair<uint64_t, uint32_t>> still;  // in a random order: by a hash of the place
  for (uint32_t i = 0; i < samples.size(); ++i)
    if (samples.attached[i] == scene::kNone)
      still.emplace_back(direct::place_key(samples.point[i], samples.normal[i]), i);
  if (still.empty()) return surface_points(scene, radius, count);
  std::sort(still.begin(), still.end());
  samples::SampleSet set = surface_points(scene, radius, count / kAnywhere);
  const PathRandom random(kLandSeed, 0);
  for (uint32_t i = 0; set.size() < count && i < count; ++i) {
    const uint32_t id = still[i % still.size()].second;
    const Vec3f point = samples.point[id], normal = samples.normal[id];
    if (i < still.size() && (i & 1)) {
      set.point.push_back(point), set.normal.push_back(normal);
      continue;
    }
    const Vec3f origin = point + normal * (0.01f * radius);
    const Vec3f w = cosine_direction(normal, random(i, 0), random(i, 1));
    const trace::Hit hit = caster.closest_static(origin, w);
    if (!hit.valid()) continue;
    set.point.push_back(origin + w * hit.t), set.normal.push_back(trace::facing_normal(hit, w));
  }
  set.radius.assign(set.size(), radius);
  set.attached.assign(set.size(), scene::kNone);
  return set;
}

}  // namespace deltalux::plan
