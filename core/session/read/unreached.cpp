// SPDX-License-Identifier: Apache-2.0
// Estimates from the power of one path, and from samples that only one batch reached, how much
// light the unreached samples miss.
#include "session/read/unreached.h"

#include <algorithm>

namespace deltalux::session {
namespace {

constexpr size_t kAsked = 1024;  // samples examined at most, evenly spaced
// Surface of a cube, 2 / 0.12^2 square scene metres, if a metre is 0.12 of its diagonal, see
// samples/placement.h.
constexpr double kRoom = 140;

/// Per channel, the largest share of a path's power that one reflection can leave.
Vec3d scattered_share(const scene::Scene& scene) {
  Vec3d most{};
  for (const scene::Material& material : scene.materials)
    most = max(most, material.kind->max_throughput(material));
  return most;
}

}  // namespace

UnreachedError::UnreachedError(const State& s) : groups_(s.sum_groups.size()) {
  const Vec3d scattered = scattered_share(s.scene);
  std::vector<double> paths(groups_.size());
  for (size_t l = 0; l < s.lights.size(); ++l) {
    const trace::Light& light = s.lights[l];
    if (!light.on) continue;
    const uint32_t g = light.sums;
    const double factor = s.birth_factor(light) * s.sum_unit(g) / s.scale.of(s.sum_groups[g].finer);
    for (int c = 0; c < 3; ++c)
      groups_[g].one[c] += factor * light.power[c] * (s.light_sampled[l] ? scattered[c] : 1.0);
    paths[g] += double(light.path_count);
  }
  const size_t n = s.samples.size(), step = (n + kAsked - 1) / kAsked;
  for (size_t g = 0; g < groups_.size(); ++g) {
    if (!(paths[g] > 0)) continue;
    Group& group = groups_[g];
    group.one = group.one * (1 / paths[g]);
    Vec3d missing = group.one, dark{};  // as if one more path had arrived
    for (size_t i = 0; i < n; i += step) {
      double sum[3] = {};
      int batches[3] = {};
      for (size_t k = 0; k < kBatches; ++k)
        for (size_t c = 0; c < 3; ++c)
          if (const int64_t own = s.discs.sums[3 * ((g * kBatches + k) * n + i) + c])
            sum[c] += double(own), ++batches[c];
      for (int c = 0; c < 3; ++c) {
        if (batches[c] == 0) dark[c] += double(s.discs.area[i]);
        if (batches[c] == 1) missing[c] += sum[c] * s.sum_unit(g);
      }
    }
    for (int c = 0; c < 3; ++c) group.density[c] = dark[c] > 0 ? missing[c] / dark[c] : 0.0;
  }
}

Vec3d power_of_one_path(const State& s) {
  Vec3d most{};
  for (const trace::Light& light : s.lights) {
    if (!light.on || light.path_count == 0 || light.map || light.aims) continue;
    const double factor = s.group_factor[light.group] / double(light.path_count);
    for (int c = 0; c < 3; ++c) most[c] = std::max(most[c], factor * light.power[c]);
  }
  const double metre = double(s.gather->cells.metre());
  return most * (1 / (kRoom * metre * metre));
}

Vec3d UnreachedError::at(uint32_t sum_group, double area) const {
  const Group& group = groups_[sum_group];
  Vec3d error{};
  for (int c = 0; c < 3; ++c) error[c] = std::min(group.one[c], group.density[c] * area);
  return error;
}

}  // namespace deltalux::session
