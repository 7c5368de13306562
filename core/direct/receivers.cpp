// SPDX-License-Identifier: Apache-2.0
// Finds with a short ray the surface that a place lies on.
#include "direct/receivers.h"

namespace deltalux::direct {
namespace {

constexpr size_t kGrain = 64;
constexpr int kMaxSheets = 16;

}  // namespace

Vec3f onto_sheets(const trace::RayCaster& caster, uint32_t body, Vec3f p, Vec3f n, float slack) {
  for (int k = 0; k < kMaxSheets && slack < scene::kSheet; ++k) {
    const Vec3f from = p + n * slack;
    const float to = scene::kSheet - slack;
    const trace::Hit hit = body == scene::kNone ? caster.closest_static(from, n, 0, to)
                                                : caster.closest_object(body, from, n, 0, to);
    if (!hit.valid()) break;
    p = from + n * hit.t;
  }
  return p;
}

std::vector<Receiver> receivers_at(const scene::Scene& scene, const trace::RayCaster& caster,
                                   std::span<const Vec3f> points, std::span<const Vec3f> normals,
                                   float within, const Workers& workers) {
  std::vector<Receiver> receivers(points.size());
  workers.for_blocks(points.size(), kGrain, [&](size_t begin, size_t end) {
    for (size_t i = begin; i < end; ++i) {
      const Vec3f n = normalize(normals[i]);  // as samples are
      const trace::Hit under = caster.closest(points[i] + n * within, -n, 0, 2 * within);
      const uint32_t object = under.valid() ? scene.object_of(under.primitive) : scene::kNone;
      const bool moves = under.valid() && scene.objects[object].movable;
      Receiver& own = receivers[i];
      own = {points[i], n, moves ? object : scene::kNone,
             under.valid() ? scene.slack_of(under.primitive) : 0.0f, place_key(points[i], n)};
      own.point = onto_sheets(caster, own.object, own.point, n, own.slack());
    }
  });
  return receivers;
}

}  // namespace deltalux::direct
