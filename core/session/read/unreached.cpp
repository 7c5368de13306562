// SPDX-License-Identifier: Apache-2.0
// Estimates from the power of one path, and from samples that only one batch reached, how much
// light the unreached samples miss.
#include "session/read/unreached.h"

#include <algorithm>

namespace deltalux::session {
namespace {

constexpr size_t kAsked = 1024;  // samples examined at most, evenly spaced

/// Whether a gather ray of the sample meets a cell that a path reached, or a chain's vertex that a
/// light illuminates.
bool sees_light(const State& s, size_t sample) {
  const auto is_lit = [&](uint32_t cell) { return cell != gather::kDark && s.cells.is_lit(cell); };
  const gather::ChainPool& chains = s.rays.hits.chains();
  for (const uint32_t target : s.rays.hits.targets(sample)) {
    if (!gather::GatherHits::is_chain(target)) {
      if (is_lit(target)) return true;
      continue;
    }
    const uint32_t number = gather::GatherHits::chain_of(target);
    if (is_lit(chains.end(number))) return true;
    for (const gather::Vertex& vertex : chains.vertices(number))
      if (vertex.is_caustic() ? is_lit(vertex.light)
                              : vertex.lamp() != scene::kNone && vertex.direct > 0)
        return true;
  }
  return false;
}

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

Vec3d UnreachedError::at(uint32_t sum_group, double area) const {
  const Group& group = groups_[sum_group];
  Vec3d error{};
  for (int c = 0; c < 3; ++c) error[c] = std::min(group.one[c], group.density[c] * area);
  return error;
}

size_t count_unreached(const State& s) {
  check_readable(s);
  const size_t n = s.samples.size(), slabs = s.discs.sums.size() / std::max<size_t>(1, 3 * n);
  size_t count = 0;
  for (size_t i = 0; i < n; ++i) {
    bool dark = s.is_present(i);
    for (size_t slab = 0; dark && slab < slabs; ++slab)
      for (size_t c = 0; c < 3; ++c) dark = dark && s.discs.sums[3 * (slab * n + i) + c] == 0;
    count += dark && !(s.gathers() && sees_light(s, i));
  }
  return count;
}

}  // namespace deltalux::session
