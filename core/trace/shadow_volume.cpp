// SPDX-License-Identifier: Apache-2.0
// Builds shadow volumes from the three axis-parallel projections of blocker and light.
#include "trace/shadow_volume.h"

#include <algorithm>

namespace deltalux::trace {

ShadowVolume::ShadowVolume(const Light& light, const Box& blocker, float slack) {
  nothing_ = blocker.empty() || !may_reach(light, blocker.padded(slack));
  if (nothing_) return;
  // Directions in which the shadow extends from the blocker: all b - l, which form a box, too.
  Box away = {light.punctual.direction, light.punctual.direction};
  if (!light.is_parallel()) {
    const Box source = light.bounds.padded(slack);
    away = {blocker.low - source.high, blocker.high - source.low};
  }
  bool done[3][3] = {};
  for (int i = 0; i < 3; ++i) {
    // An axis along which the blocker lies completely on one side of the light.
    const double side = away.low[i] > 0 ? 1 : away.high[i] < 0 ? -1 : 0;
    if (side == 0) continue;
    Vec3d facing{};
    facing[i] = -side;
    add(facing, blocker, slack);
    const double near = side > 0 ? away.low[i] : -away.high[i];
    const double far = side > 0 ? away.high[i] : -away.low[i];
    for (int j = 0; j < 3; ++j) {
      if (i == j || done[i][j]) continue;
      done[i][j] = done[j][i] = true;
      // The steepest and the flattest direction of the wedge that this projection of `away` spans.
      const double high = away.high[j], low = away.low[j];
      const double steepest = high / (high > 0 ? near : far);
      const double flattest = low / (low > 0 ? far : near);
      Vec3d above{}, below{};
      above[i] = -steepest * side, above[j] = 1;
      below[i] = flattest * side, below[j] = -1;
      add(above, blocker, slack);
      add(below, blocker, slack);
    }
  }
}

void ShadowVolume::add(Vec3d normal, const Box& blocker, float slack) {
  const Vec3d n = normalize(normal);
  double limit = slack;
  for (int axis = 0; axis < 3; ++axis)
    limit += n[axis] * double(n[axis] > 0 ? blocker.high[axis] : blocker.low[axis]);
  planes_[count_++] = {float(n.x), float(n.y), float(n.z), float(limit)};
}

bool ShadowVolume::misses(const Box& points) const {
  for (size_t i = 0; i < count_; ++i) {
    const Plane& p = planes_[i];
    const float lowest =
        p.height(p.a > 0 ? points.low.x : points.high.x, p.b > 0 ? points.low.y : points.high.y,
                 p.c > 0 ? points.low.z : points.high.z);
    if (lowest > p.limit) return true;
  }
  return nothing_;
}

Box ShadowVolume::bounds(Box space) const {
  constexpr int kSide = 8, kRounds = 3;  // each divides what is left of the space more finely
  if (nothing_) return {};
  for (int round = 0; round < kRounds; ++round) {
    std::array<Vec3f, kSide + 1> at;
    for (int i = 0; i < kSide; ++i)
      at[size_t(i)] = space.low + (space.high - space.low) * (float(i) / kSide);
    at[kSide] = space.high;
    Box found;
    for (size_t x = 0; x < kSide; ++x)
      for (size_t y = 0; y < kSide; ++y)
        for (size_t z = 0; z < kSide; ++z) {
          const Box part{{at[x].x, at[y].y, at[z].z}, {at[x + 1].x, at[y + 1].y, at[z + 1].z}};
          if (!misses(part)) found.grow(part);
        }
    space = found;
    if (space.empty()) break;
  }
  return space;
}

void ShadowVolume::mark(const float* x, const float* y, const float* z, size_t count,
                        uint32_t* marks) const {
  if (nothing_) return;
  constexpr size_t kWidth = 64;  // a mask that fits into registers or the first-level cache
  for (size_t begin = 0; begin < count; begin += kWidth) {
    const size_t n = std::min(kWidth, count - begin);
    uint32_t inside[kWidth];
    std::fill_n(inside, n, 1u);
    for (size_t k = 0; k < count_; ++k) {
      const Plane plane = planes_[k];
      for (size_t i = 0; i < n; ++i)
        inside[i] &= plane.height(x[begin + i], y[begin + i], z[begin + i]) <= plane.limit;
    }
    for (size_t i = 0; i < n; ++i) marks[begin + i] |= inside[i];
  }
}

}  // namespace deltalux::trace
