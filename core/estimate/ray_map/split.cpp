// SPDX-License-Identifier: Apache-2.0
// Chooses where to split a leaf of a ray map.
#include "estimate/ray_map/split.h"

#include <algorithm>

namespace deltalux::estimate {
namespace {

constexpr size_t kMaxLooked = 64;  // queries that represent all
constexpr int kPlanes = 9;         // per axis

}  // namespace

SplitChoice choose_split(std::span<const Box> boxes, std::span<const uint32_t> queries,
                         const Box& cell, const Box& bounds, uint32_t visits, float split_cost) {
  SplitChoice best;
  const size_t count = queries.size(), stride = (count + kMaxLooked - 1) / kMaxLooked;
  if (!count || float(visits) <= split_cost) return best;
  Box looked[kMaxLooked], around;
  size_t n = 0;
  for (size_t i = 0; i < count; i += stride) {
    looked[n] = boxes[queries[i]];
    around.grow(looked[n++]);
  }
  const Box inside{max(cell.low, bounds.low), min(cell.high, bounds.high)};
  const Vec3f extent = max(inside.extent(), Vec3f{});
  const float whole = half_area(extent);
  if (!(whole > 0)) return best;
  float least = 1.0f - split_cost / float(visits);
  for (int axis = 0; axis < 3; ++axis) {
    if (!(extent[axis] > 0)) continue;
    const float step = (around.high[axis] - around.low[axis]) / float(kPlanes - 1);
    for (int k = 0; k < kPlanes; ++k) {
      const float plane = k == kPlanes - 1 ? around.high[axis] : around.low[axis] + float(k) * step;
      if (!(plane > inside.low[axis] && plane < inside.high[axis])) continue;
      size_t below = 0, above = 0;
      for (size_t i = 0; i < n; ++i) {
        below += looked[i].low[axis] < plane;
        above += looked[i].high[axis] > plane;
      }
      Vec3f low = extent, high = extent;
      low[axis] = plane - inside.low[axis], high[axis] = inside.high[axis] - plane;
      const float cost =
          (float(below) * half_area(low) + float(above) * half_area(high)) / (float(n) * whole);
      if (cost >= least) continue;
      least = cost;
      best = {true, axis, plane};
    }
  }
  return best;
}

}  // namespace deltalux::estimate
