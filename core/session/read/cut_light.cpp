// SPDX-License-Identifier: Apache-2.0
// Sums the power of the last segments, and continues it as a geometric series.
#include "session/read/cut_light.h"

#include <algorithm>

namespace deltalux::session {
namespace {

/// The share of the power that goes on forever counts as this many times what lands last: in a room
/// that absorbs nothing, the series has no sum.
constexpr double kMostLeft = 1e6;

/// Power that lands in segments of one bounce, with the present dimming, and what its surfaces
/// reflect of it.
struct Landed {
  Vec3d power{}, reflected{};
};

Landed landed(const State& s, uint32_t bounce, std::span<const double> units) {
  const segments::BounceSegments& stored = s.paths.store.bounces()[bounce];
  Landed sum;
  for (uint32_t slot = 0; slot < stored.size(); ++slot) {
    const segments::Segment& segment = stored.at(slot);
    if (segment.length < 0 || segment.primitive == scene::kNone) continue;
    const Vec3f reflectance = s.scene.material_of(segment.primitive).reflectance;
    const double unit = units[s.lights[s.light_of(segment.path)].sums];
    for (int c = 0; c < 3; ++c) {
      const double own = unit * double(segment.power[c]);
      sum.power[c] += own, sum.reflected[c] += own * double(reflectance[c]);
    }
  }
  return sum;
}

}  // namespace

Vec3d cut_share(const State& s) {
  const auto& bounces = s.paths.store.bounces();
  const uint32_t last = s.options.max_bounces - 1;
  if (bounces.size() <= last || bounces[last].live() == 0) return {};
  const std::vector<double> units = s.sum_units();
  Vec3d all{};
  for (uint32_t b = 0; b < last; ++b) all = all + landed(s, b, units).power;
  const Landed end = landed(s, last, units);
  Vec3d share{};
  for (int c = 0; c < 3; ++c) {
    const double kept = end.power[c] - end.reflected[c];  // 1 - reflectance, times the power
    if (!(end.reflected[c] > 0)) continue;
    const double left =
        end.reflected[c] * std::min(end.power[c] / std::max(kept, 1e-300), kMostLeft);
    share[c] = left / (all[c] + end.power[c]);
  }
  return share;
}

}  // namespace deltalux::session
