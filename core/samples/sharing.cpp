// SPDX-License-Identifier: Apache-2.0
// Weights by the split-sphere model, among samples that are close along the mesh.
#include "samples/sharing.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace deltalux::samples {
namespace {

constexpr size_t kGrain = 4096;

/// For each group, the groups that edges of triangles lead to.
class Adjacency {
 public:
  Adjacency(std::span<const Triangle> triangles, std::span<const int64_t> group, size_t groups)
      : begin_(groups + 1) {
    std::vector<std::array<uint32_t, 2>> pairs;
    for (const Triangle& triangle : triangles)
      for (size_t k = 0; k < 3; ++k) {
        const auto one = uint32_t(group[size_t(triangle[k])]);
        const auto two = uint32_t(group[size_t(triangle[(k + 1) % 3])]);
        if (one != two) pairs.push_back({one, two}), pairs.push_back({two, one});
      }
    std::sort(pairs.begin(), pairs.end());
    pairs.erase(std::unique(pairs.begin(), pairs.end()), pairs.end());
    for (const auto& [one, two] : pairs) ++begin_[one + 1], beside_.push_back(two);
    for (size_t i = 0; i < groups; ++i) begin_[i + 1] += begin_[i];
  }
  /// Whether one leads to the other in at most two steps.
  bool close(uint32_t one, uint32_t two) const {
    if (one == two) return true;
    const auto a = of(one), b = of(two);
    if (std::binary_search(a.begin(), a.end(), two)) return true;
    for (auto i = a.begin(), k = b.begin(); i != a.end() && k != b.end();) {
      if (*i == *k) return true;
      *i < *k ? ++i : ++k;
    }
    return false;
  }

 private:
  std::span<const uint32_t> of(uint32_t group) const {
    return std::span(beside_).subspan(begin_[group], begin_[group + 1] - begin_[group]);
  }
  std::vector<size_t> begin_;
  std::vector<uint32_t> beside_;
};

}  // namespace

std::vector<int64_t> centroid_vertices(std::span<const Vec3d> points,
                                       std::span<const int64_t> group) {
  const size_t groups =
      group.empty() ? 0 : size_t(*std::max_element(group.begin(), group.end())) + 1;
  std::vector<Vec3d> middle(groups);
  std::vector<double> size(groups), least(groups, std::numeric_limits<double>::infinity());
  for (size_t i = 0; i < points.size(); ++i) {
    const auto g = size_t(group[i]);
    middle[g] = middle[g] + points[i], ++size[g];
  }
  for (size_t g = 0; g < groups; ++g) middle[g] = middle[g] * (1 / size[g]);
  std::vector<int64_t> out(groups);
  for (size_t i = 0; i < points.size(); ++i) {
    const auto g = size_t(group[i]);
    const double off = length(points[i] - middle[g]);
    if (off < least[g]) least[g] = off, out[g] = int64_t(i);
  }
  return out;
}

SharedWeights shared_weights(const GroupedMesh& mesh, std::span<const int64_t> others,
                             std::span<const std::array<int64_t, kNeighbours>> near,
                             const SharingRule& rule, const Workers& workers) {
  const Adjacency adjacency(mesh.triangles, mesh.group, mesh.vertex.size());
  std::vector<int64_t> sample_of(mesh.vertex.size());  // by group
  for (size_t i = 0; i < mesh.vertex.size(); ++i)
    sample_of[size_t(mesh.group[size_t(mesh.vertex[i])])] = int64_t(i);
  SharedWeights out;
  out.samples.resize(others.size()), out.weights.resize(others.size());
  workers.for_blocks(others.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const auto v = size_t(others[i]);
      const int64_t own = sample_of[size_t(mesh.group[v])];
      std::array<int64_t, kNeighbours> samples = near[i];
      samples.back() = own;
      std::sort(samples.begin(), samples.end());
      std::array<double, kNeighbours> weight{};
      double all = 0;
      for (size_t k = 0; k < kNeighbours; ++k) {
        const auto there = size_t(mesh.vertex[size_t(samples[k])]);
        const double distance = length(mesh.points[v] - mesh.points[there]) / rule.edge;
        const double turn = dot(mesh.normals[v], mesh.normals[there]);
        if (!(distance < rule.reach && turn > rule.least_cosine) ||
            mesh.kind[there] != mesh.kind[v] || (k > 0 && samples[k] == samples[k - 1]) ||
            !adjacency.close(uint32_t(mesh.group[v]), uint32_t(mesh.group[there])))
          continue;
        const double bound = distance + std::sqrt(std::max(0.0, 1 - turn)) + rule.least_bound;
        all += weight[k] = 1 / (bound * bound);
      }
      if (!(all > 0)) {
        const auto first = std::find(samples.begin(), samples.end(), own) - samples.begin();
        all = weight[size_t(first)] = 1;
      }
      for (size_t k = 0; k < kNeighbours; ++k) {
        out.samples[i][k] = int32_t(samples[k]);
        out.weights[i][k] = float(weight[k] / all);
      }
    }
  });
  return out;
}

}  // namespace deltalux::samples
