// SPDX-License-Identifier: Apache-2.0
// Both sides of a triangle get the same points.
#include "gather/cells/cell_tints.h"

#include <algorithm>
#include <cmath>

#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr double kPerSquare = 256;                      // points on the area of a square
constexpr double kMinPoints = 4, kMaxPoints = 1 << 20;  // points on a triangle
constexpr uint64_t kCheck = 1 << 14;                    // points between checks for cancellation

bool varies(const scene::Scene& scene, const BodyCells::Triangle& triangle) {
  return scene.materials[triangle.material].varies();
}

}  // namespace

bool any_varies(const scene::Scene& scene, std::span<const BodyCells::Triangle> triangles) {
  return std::any_of(triangles.begin(), triangles.end(),
                     [&](const BodyCells::Triangle& own) { return varies(scene, own); });
}

void add_cell_tints(const scene::Scene& scene, uint32_t first_primitive,
                    std::span<const BodyCells::Triangle> triangles, const BodyCells& cells,
                    float edge, const Progress& progress, std::vector<Vec3f>& out,
                    std::span<float> areas) {
  std::vector<Vec3d> sum(cells.size());
  std::vector<double> all(cells.size()), solid(cells.size()), diffuse(cells.size());
  uint64_t points = 0;
  for (uint32_t t = 0; t < triangles.size(); ++t) {
    if (!varies(scene, triangles[t])) continue;
    const Vec3f* corner = triangles[t].corner;
    const Vec3f e = corner[1] - corner[0], f = corner[2] - corner[0], n = cross(e, f);
    const double own = 0.5 * length(Vec3d(n));
    if (!(own > 0)) continue;
    const double wanted = kPerSquare * own / (double(edge) * double(edge));
    const auto count = uint32_t(std::clamp(wanted, kMinPoints, kMaxPoints));
    const double each = own / count;
    for (uint32_t i = 0; i < count; ++i) {
      if (++points % kCheck == 0) progress.check();
      float u = unit_float32(sobol::point(i, 0)), v = unit_float32(sobol::point(i, 1));
      if (u + v > 1) u = 1 - u, v = 1 - v;  // folds the square into the triangle
      const bool is_hole = scene.lets_pass(first_primitive + t, u, v);
      const Vec3d tint(scene.tint_at(first_primitive + t, u, v));
      const double share = is_hole ? 0 : each * scene.diffuse_share(first_primitive + t, u, v);
      for (const Vec3f& w : {-n, n}) {
        const uint32_t cell = cells.find(t, corner[0] + e * u + f * v, w);
        if (cell == kNoCell) continue;
        sum[cell] = sum[cell] + tint * share, diffuse[cell] += share;
        all[cell] += each, solid[cell] += is_hole ? 0 : each;
      }
    }
  }
  out.reserve(out.size() + cells.size());
  for (size_t cell = 0; cell < cells.size(); ++cell) {
    out.push_back(diffuse[cell] > 0 ? Vec3f(sum[cell] * (1 / diffuse[cell])) : Vec3f{1, 1, 1});
    if (all[cell] > 0) areas[cell] *= float(solid[cell] / all[cell]);
  }
}

}  // namespace deltalux::gather
