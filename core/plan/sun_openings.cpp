// SPDX-License-Identifier: Apache-2.0
// Casts rings of rays around a beam, back towards the sun: the narrowest that is blocked tells
// where the opening is, and how large.
#include "plan/sun_openings.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/hemisphere.h"
#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::plan {
namespace {

constexpr int kRings = 24;       // each wider than the one before by the square root of 2
constexpr float kWidest = 0.5f;  // tangent of their angle from the beam
constexpr size_t kRays = 8;      // of a ring
constexpr size_t kBlocked = 6;   // so many of which are blocked around an opening
constexpr float kInside = 0.7f;  // share of the radius within which rays start
constexpr float kApart = 0.01f;  // of the radius: start of the rays above the opening

}  // namespace

std::optional<Opening> find_opening(const trace::RayCaster& caster, Vec3f landing, Vec3f to_sun) {
  Vec3f u, v;
  tangent_frame(to_sun, u, v);
  for (int ring = 0; ring < kRings; ++ring) {
    const float wide = kWidest * std::exp2(-0.5f * float(kRings - 1 - ring));
    std::vector<std::pair<float, Vec3f>> walls;  // depth along the beam, normal
    for (size_t k = 0; k < kRays; ++k) {
      const Vec3f w = normalize(to_sun + on_circle(u, v, (float(k) + 0.5f) / float(kRays)) * wide);
      const trace::Hit hit = caster.closest_static(landing, w);
      if (hit.valid()) walls.emplace_back(hit.t * dot(w, to_sun), facing(hit.normal, -to_sun));
    }
    if (walls.size() < kBlocked) continue;
    const auto middle = walls.begin() + long(walls.size() / 2);
    std::nth_element(walls.begin(), middle, walls.end(),
                     [](const auto& a, const auto& b) { return a.first < b.first; });
    return Opening{landing + to_sun * middle->first, middle->second, middle->first * wide};
  }
  return std::nullopt;
}

std::vector<Reflector> reflectors_of(const scene::Scene& scene, const trace::RayCaster& caster,
                                     const Opening& opening, uint32_t count, uint64_t seed) {
  Vec3f u, v;
  tangent_frame(opening.normal, u, v);
  const double area = std::numbers::pi * double(opening.radius) * double(opening.radius);
  std::vector<Reflector> out;
  for (uint32_t k = 0; k < count; ++k) {
    const auto r = sobol::sample(k, seed);
    const float aside = kInside * opening.radius * std::sqrt(r[3]);
    const Vec3f from = opening.centre + on_circle(u, v, r[2]) * aside +
                       opening.normal * (kApart * opening.radius + position_slack(opening.centre));
    const Vec3f w = cosine_direction(opening.normal, r[0], r[1]);
    const trace::Hit hit = caster.closest_static(from, w);
    if (!hit.valid()) continue;
    const Vec3f n = trace::facing_normal(hit, w);
    const double squared = std::max(double(hit.t) * double(hit.t), area);
    const double chance =
        area * double(dot(opening.normal, w)) * double(-dot(n, w)) / (std::numbers::pi * squared);
    const Vec3f at = trace::leave_surface(from, w, hit, n, scene.slack_of(hit.primitive));
    out.push_back({at, n, hit.primitive, std::min(chance, 1.0)});
  }
  return out;
}

}  // namespace deltalux::plan
