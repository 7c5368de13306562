// SPDX-License-Identifier: Apache-2.0
// Casts rays from points spread by area over the triangles of each clump.
#include "gather/cells/exposure.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "base/hemisphere.h"
#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr uint32_t kPoints = 16, kRays = 8;  // of a cell; of a point
constexpr size_t kGrain = 64;
constexpr double kLeast = 0.25, kMost = 2;  // limits of the share, which noise might exceed

/// The triangles of one cell.
struct Surface {
  const scene::Scene& scene;
  uint32_t body;
  std::span<const uint32_t> triangles;
  bool back;
  std::vector<double> area;  ///< cumulative
};

/// How many rays from each point of a cell get away.
std::array<uint32_t, kPoints> free_rays(const Surface& own, uint64_t key, float near,
                                        const Closest& closest) {
  std::array<uint32_t, kPoints> free{};
  for (uint32_t k = 0; k < kPoints; ++k) {
    const PathRandom random(key, k);
    const double wanted = (double(k) + double(random(0, 0))) / kPoints * own.area.back();
    const auto found = std::upper_bound(own.area.begin(), own.area.end() - 1, wanted);
    const uint32_t triangle = own.triangles[size_t(found - own.area.begin())];
    const scene::Face face = own.scene.face(own.body, triangle);
    const Vec3f e = face.corner[1] - face.corner[0], f = face.corner[2] - face.corner[0];
    const float u = std::sqrt(random(0, 1)), v = random(0, 2);
    Vec3f n = face.normal();
    if (own.back) n = -n;
    const Vec3f p = face.corner[0] + e * (u * (1 - v)) + f * (u * v);
    const uint32_t first =
        own.body == scene::kNone ? 0 : own.scene.objects[own.body].first_primitive;
    const Vec3f from = p + n * (position_slack(p) + own.scene.slack_of(first + triangle));
    for (uint32_t i = 0; i < kRays; ++i) {
      const auto r = sobol::sample(k * kRays + i, key);
      const Vec3f w = cosine_direction(n, r[0], r[1]);
      free[k] += !(closest(from, w, near).t < near);
    }
  }
  return free;
}

/// mean(e)^2 / mean(e^2), where the square is estimated from pairs of rays.
float share_of(const std::array<uint32_t, kPoints>& free) {
  double sum = 0, pairs = 0;
  for (const uint32_t count : free) {
    sum += double(count) / kRays;
    pairs += double(count) * (double(count) - 1) / (kRays * (kRays - 1));
  }
  if (!(pairs > 0)) return 1;
  return float(std::clamp(sum * sum / (kPoints * pairs), kLeast, kMost));
}

}  // namespace

std::vector<float> exposed_shares(const scene::Scene& scene, uint32_t body, const BodyCells& cells,
                                  const float* near, const Closest& closest, const Workers& workers,
                                  const Progress& progress) {
  std::vector<float> shares(cells.size(), 1);
  std::vector<uint32_t> triangles, begin;
  cells.sort_small(triangles, begin);
  workers.for_blocks(cells.size(), kGrain, [&](size_t first, size_t end) {
    for (size_t cell = first; cell < end; ++cell) {
      // A flat cell hides nothing of itself.
      const size_t count = begin[cell + 1] - begin[cell];
      if (count < 2) continue;
      progress.check();
      Surface own{scene,
                  body,
                  std::span(triangles).subspan(begin[cell], count),
                  cells.is_back(uint32_t(cell)),
                  {}};
      double sum = 0;
      for (const uint32_t t : own.triangles) {
        const scene::Face face = scene.face(body, t);
        own.area.push_back(sum += length(cross(Vec3d(face.corner[1] - face.corner[0]),
                                               Vec3d(face.corner[2] - face.corner[0]))));
      }
      const uint64_t key = combine(0x6578706f73656421ull, cell);
      shares[cell] = share_of(free_rays(own, key, near[cell], closest));
    }
  });
  return shares;
}

}  // namespace deltalux::gather
