// SPDX-License-Identifier: Apache-2.0
// Finds with a short ray the surface that a place lies on.
#include "direct/receivers.h"

namespace deltalux::direct {
namespace {

constexpr size_t kGrain = 64;

}  // namespace

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
      receivers[i] = {points[i], n, moves ? object : scene::kNone,
                      under.valid() ? scene.slack_of(under.primitive) : 0.0f,
                      place_key(points[i], n)};
    }
  });
  return receivers;
}

}  // namespace deltalux::direct
