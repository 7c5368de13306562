// SPDX-License-Identifier: Apache-2.0
// Shared samples against their definition, on random meshes: which samples serve a vertex, and
// their weights.
#include "samples/sharing.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "disc_world.h"

namespace deltalux::samples {
namespace {

using estimate::Draw;
constexpr int64_t kSide = 14;  // vertices along a side of the sheet

/// A crumpled sheet, in groups of two by two vertices, with holes and two kinds of vertices.
struct Sheet {
  std::vector<Vec3d> points, normals;
  std::vector<Triangle> triangles;
  std::vector<int64_t> kind, group, vertex, others;
  std::vector<std::array<int64_t, kNeighbours>> near;

  explicit Sheet(Draw& draw) {
    constexpr int64_t kGroups = kSide * kSide / 4;
    std::vector<std::vector<int64_t>> members(kGroups);
    for (int64_t i = 0; i < kSide * kSide; ++i) {
      const int64_t x = i % kSide, y = i / kSide;
      points.push_back({double(x), double(y), double(draw.range(-0.4f, 0.4f))});
      normals.push_back(normalize(
          Vec3d(Vec3f{draw.range(-1, 1), draw.range(-1, 1), draw.chance(0.1f) ? -1.0f : 1.0f})));
      kind.push_back(draw.chance(0.15f));
      group.push_back(y / 2 * (kSide / 2) + x / 2);
      members[size_t(group.back())].push_back(i);
      if (x + 1 < kSide && y + 1 < kSide && draw.chance(0.7f)) {
        // In any order of corners: an edge leads both ways.
        const Triangle t{i, i + 1, i + kSide};
        triangles.push_back(draw.chance(0.5f) ? t : Triangle{t[2], t[1], t[0]});
      }
    }
    for (const auto& own : members) vertex.push_back(own[draw.below(4)]);
    for (size_t i = vertex.size(); i > 1; --i)  // samples are in another order than groups
      std::swap(vertex[i - 1], vertex[draw.below(uint32_t(i))]);
    for (int64_t v = 0; v < kSide * kSide; ++v) {
      others.push_back(v);
      std::array<int64_t, kNeighbours> own;
      for (int64_t& sample : own) {
        do sample = draw.below(kGroups);
        while (length(points[size_t(vertex[size_t(sample)])] - points[size_t(v)]) > 5);
      }
      near.push_back(own);
    }
  }
  GroupedMesh mesh() const { return {points, normals, triangles, kind, group, vertex}; }

  /// The groups that at most two edges of triangles lead to.
  std::set<int64_t> around(int64_t from) const {
    std::set<int64_t> all{from};
    for (int step = 0; step < 2; ++step) {
      const std::set<int64_t> before = all;
      for (const Triangle& t : triangles)
        for (const int64_t a : t)
          for (const int64_t b : t)
            if (before.contains(group[size_t(a)])) all.insert(group[size_t(b)]);
    }
    return all;
  }
};

/// The weights of all samples for one vertex, by sample.
std::vector<double> slow_weights(const Sheet& sheet, size_t i, const SharingRule& rule) {
  const auto v = size_t(sheet.others[i]);
  std::vector<double> weight(sheet.vertex.size());
  size_t own = 0;
  while (sheet.group[size_t(sheet.vertex[own])] != sheet.group[v]) ++own;
  std::set<size_t> candidates{own};
  for (size_t k = 0; k + 1 < kNeighbours; ++k) candidates.insert(size_t(sheet.near[i][k]));
  const std::set<int64_t> around = sheet.around(sheet.group[v]);
  double all = 0;
  for (const size_t sample : candidates) {
    const auto there = size_t(sheet.vertex[sample]);
    const double distance = length(sheet.points[v] - sheet.points[there]) / rule.edge;
    const double turn = dot(sheet.normals[v], sheet.normals[there]);
    if (distance >= rule.reach || turn <= rule.least_cosine) continue;
    if (sheet.kind[v] != sheet.kind[there] || !around.contains(sheet.group[there])) continue;
    all += weight[sample] =
        std::pow(distance + std::sqrt(std::max(0.0, 1 - turn)) + rule.least_bound, -2);
  }
  if (all == 0) all = weight[own] = 1;
  for (double& each : weight) each /= all;
  return weight;
}

TEST(Sharing, WeightsAreTheirDefinition) {
  const SharingRule rule{1.7, 1.6, 0.2, 0.15};
  size_t shared = 0, alone = 0;
  for (uint64_t seed = 0; seed < 6; ++seed) {
    Draw draw(seed);
    const Sheet sheet(draw);
    const SharedWeights found =
        shared_weights(sheet.mesh(), sheet.others, sheet.near, rule, Workers(1 + int(seed % 3)));
    for (size_t i = 0; i < sheet.others.size(); ++i) {
      std::vector<double> weight(sheet.vertex.size());
      for (size_t k = 0; k < kNeighbours; ++k)
        weight[size_t(found.samples[i][k])] += double(found.weights[i][k]);
      const std::vector<double> expected = slow_weights(sheet, i, rule);
      for (size_t sample = 0; sample < weight.size(); ++sample)
        EXPECT_NEAR(weight[sample], expected[sample], 1e-6) << seed << " " << i << " " << sample;
      EXPECT_TRUE(std::is_sorted(found.samples[i].begin(), found.samples[i].end()));
      const auto used = std::count_if(weight.begin(), weight.end(), [](double w) { return w > 0; });
      ++(used > 1 ? shared : alone);
    }
  }
  EXPECT_GT(shared, 200u);
  EXPECT_GT(alone, 200u);
}

TEST(Sharing, CentroidsAreMeansOfTheirGroups) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    Draw draw(seed);
    std::vector<Vec3d> points;
    std::vector<int64_t> group;
    const uint32_t groups = 1 + draw.below(9);
    for (uint32_t i = 0; i < 60; ++i) {
      points.push_back(Vec3d(draw.in_cube(2)));
      group.push_back(i < groups ? i : draw.below(groups));  // none is empty
    }
    const std::vector<int64_t> found = centroid_vertices(points, group);
    ASSERT_EQ(found.size(), groups);
    for (int64_t g = 0; g < int64_t(groups); ++g) {
      Vec3d sum{};
      double count = 0;
      for (size_t i = 0; i < points.size(); ++i)
        if (group[i] == g) sum = sum + points[i], ++count;
      const auto off = [&](int64_t i) { return length(points[size_t(i)] - sum * (1 / count)); };
      const int64_t own = found[size_t(g)];
      EXPECT_EQ(group[size_t(own)], g);
      for (size_t i = 0; i < points.size(); ++i)
        if (group[i] == g) EXPECT_LE(off(own), off(int64_t(i)) + 1e-12);
    }
  }
  EXPECT_TRUE(centroid_vertices({}, {}).empty());
  // The first one of two that are equally near.
  const std::vector<Vec3d> pair{{0, 0, 0}, {1, 0, 0}, {2, 0, 0}, {3, 0, 0}};
  EXPECT_EQ(centroid_vertices(pair, std::vector<int64_t>{0, 0, 0, 0}), (std::vector<int64_t>{1}));
}

}  // namespace
}  // namespace deltalux::samples
