// SPDX-License-Identifier: Apache-2.0
// Finds the least growth of squares that keeps their number within limits.
#include "gather/cells/square_edges.h"

#include <algorithm>
#include <cmath>

#include "base/hemisphere.h"
#include "base/random.h"

namespace deltalux::gather {
namespace {

constexpr double kMaxOfPlane = 1 << 14;  // squares; beyond, they are larger
// Squares of a body: from the first on, those grow that are far from all else; from the second on,
// all grow.
constexpr double kMany = 1 << 16, kMost = 1 << 19;
constexpr double kApparent = 0.1;  // edge over distance up to which the former may grow
constexpr double kOwnSize = 0.5;   // share of a plane's size that counts as its distance at most
constexpr double kFew = 4;         // planes of so few squares stay as they are
constexpr int kSteps = 40;         // of bisection
constexpr uint32_t kPoints = 4, kRays = 4;  // of a plane; of a point, on each side

/// Squares beyond the first of each plane.
double count(std::span<const PlaneSize> planes, std::span<const double> edges) {
  double sum = 0;
  for (size_t i = 0; i < planes.size(); ++i)
    sum += std::max(0.0, planes[i].area / (edges[i] * edges[i]) - 1);
  return sum;
}

/// The sum of the inverse distances to what rays on one side of a point hit.
double inverse_sum(const trace::RayCaster& caster, Vec3f from, Vec3f normal, uint32_t point) {
  double sum = 0;
  for (uint32_t k = 0; k < kRays; ++k) {
    const auto r = sobol::sample(point * kRays + k, 0x73717561726573ull);
    const trace::Hit hit = caster.closest_static(from, cosine_direction(normal, r[0], r[1]));
    if (hit.valid()) sum += 1 / std::max(double(hit.t), double(std::numeric_limits<float>::min()));
  }
  return sum;
}

}  // namespace

Distance distance_to_surroundings(const scene::Scene& scene, const trace::RayCaster& caster) {
  return [&](std::span<const uint32_t> triangles) {
    double sides[2] = {0, 0};
    for (uint32_t k = 0; k < kPoints; ++k) {
      const uint32_t triangle = triangles[size_t(k) * triangles.size() / kPoints];
      const scene::Face face = scene.face(scene::kNone, triangle);
      auto r = sobol::sample(k, 0x65646765ull);
      if (r[0] + r[1] > 1) r[0] = 1 - r[0], r[1] = 1 - r[1];
      const Vec3f e = face.corner[1] - face.corner[0], f = face.corner[2] - face.corner[0];
      const Vec3f p = face.corner[0] + e * r[0] + f * r[1];
      const Vec3f n = face.normal();
      const float lift = position_slack(p) + scene.slack_of(triangle);
      sides[0] += inverse_sum(caster, p + n * lift, n, k);
      sides[1] += inverse_sum(caster, p - n * lift, -n, k);
    }
    return kPoints * kRays / std::max(sides[0], sides[1]);
  };
}

std::vector<double> square_edges(std::span<const PlaneSize> planes, double edge,
                                 const Distance& distance) {
  std::vector<double> edges;
  for (const PlaneSize& plane : planes)
    edges.push_back(std::max(edge, std::sqrt(plane.area / kMaxOfPlane)));
  // The least growth, up to `most`, with at most `limit` squares.
  const auto grow = [&](double limit, double most, const auto& grown) {
    if (!(count(planes, edges) > limit)) return;
    const auto all = [&](double growth) {
      std::vector<double> out(planes.size());
      for (size_t i = 0; i < planes.size(); ++i) out[i] = grown(i, growth);
      return out;
    };
    double low = 0, high = most;
    for (int step = 0; step < kSteps; ++step) {
      const double middle = 0.5 * (low + high);
      (count(planes, all(middle)) > limit ? low : high) = middle;
    }
    edges = all(high);
  };
  if (distance && count(planes, edges) > kMany) {
    std::vector<double> away;
    for (size_t i = 0; i < planes.size(); ++i) {
      const auto& [triangles, area] = planes[i];
      const bool few = area < kFew * edges[i] * edges[i];
      away.push_back(few ? 0 : std::min(distance(triangles), kOwnSize * std::sqrt(area)));
    }
    grow(kMany, kApparent,
         [&](size_t i, double growth) { return std::max(edges[i], growth * away[i]); });
  }
  const double whole = std::sqrt(kMaxOfPlane);  // from one square to all of a plane
  grow(kMost, whole, [&](size_t i, double growth) { return edges[i] * (1 + growth); });
  return edges;
}

}  // namespace deltalux::gather
