// SPDX-License-Identifier: Apache-2.0
// Predicts seconds and bytes from counts and constants.
#include "plan/cost_model.h"

#include <algorithm>
#include <cmath>

namespace deltalux::plan {

Machine typical_machine() {
  constexpr double ns = 1e-9;
  const auto of = [&](double build, std::initializer_list<std::pair<Count, double>> terms) {
    Constants constants{1, {}, build * ns};
    for (const auto& [count, value] : terms) constants.seconds[count] = value * ns;
    return MethodConstants{constants};
  };
  Machine machine;
  const auto at = [&](Method method) -> MethodConstants& { return machine[size_t(method)]; };
  at(Method::brute_force) =
      of(20, {{kSegments, 10}, {kDiscTests, 5}, {kTurns, 8}, {kHits, 15}, {kOutlineTests, 40}});
  at(Method::disc_index) =
      of(350, {{kSegments, 10}, {kNodeTests, 4}, {kDiscTests, 1}, {kHits, 4}, {kOutlineTests, 40}});
  at(Method::ray_map) = of(20, {{kSegments, 25},
                                {kVisits, 20},
                                {kNodeTests, 1.7},
                                {kDiscTests, 1},
                                {kBoxTests, 4},
                                {kSplits, 1800},
                                {kHits, 80},
                                {kOutlineTests, 20}});
  at(Method::sphere_cache) = of(90, {{kSegments, 30},
                                     {kVisits, 120},
                                     {kDiscTests, 1.5},
                                     {kSphereTests, 1.1},
                                     {kFarTests, 0.5},
                                     {kRebuilds, 95},
                                     {kHits, 7},
                                     {kFarHits, 6},
                                     {kOutlineTests, 30}});
  return machine;
}

Constants constants_at(const MethodConstants& constants, double size) {
  const auto above = std::find_if(constants.begin(), constants.end(),
                                  [&](const Constants& c) { return c.size >= size; });
  if (above == constants.begin() || constants.size() == 1) return constants.front();
  const bool beyond = above == constants.end();
  const Constants& low = beyond ? constants[constants.size() - 2] : *(above - 1);
  const Constants& high = beyond ? constants.back() : *above;
  const double share = std::log(size / low.size) / std::log(high.size / low.size);
  const auto between = [&](double a, double b) {
    return beyond ? std::max(b, a + share * (b - a)) : a + share * (b - a);
  };
  Constants found{size, {}, between(low.build, high.build)};
  for (size_t i = 0; i < kCounts; ++i) found.seconds[i] = between(low.seconds[i], high.seconds[i]);
  return found;
}

double search_seconds(const Counts& counts, const Constants& constants) {
  double sum = 0;
  for (size_t i = 0; i < kCounts; ++i) sum += counts[i] * constants.seconds[i];
  return sum;
}

double size_of(Method method, double discs, double span) {
  const bool by_segments = method == Method::sphere_cache || method == Method::ray_map;
  return std::max(1.0, by_segments ? span : discs);
}

double method_bytes(Method method, double discs, double span) {
  switch (method) {
    case Method::disc_index:
      return 90 * discs;
    case Method::sphere_cache:
      // Lists of all spheres (a geometric series with Q² = 4/9), and the order of visits.
      return 32 * span * (1 + 4.0 / 5) + 4 * discs;
    case Method::ray_map:
      // Segments, the lists on the current path down the tree, and boxes of the discs.
      return 60 * span + 28 * discs;
    default:
      return 0;
  }
}

}  // namespace deltalux::plan
