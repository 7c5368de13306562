// SPDX-License-Identifier: Apache-2.0
// Builds a ray caster for each movable that samples are attached to.
#include "session/world/ground.h"

#include <limits>
#include <map>

namespace deltalux::session {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr Box kEverywhere{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};

/// A scene of one object's triangles alone, in its local space, so that outlines of discs do not
/// depend on the pose, not even by rounding.
scene::Scene local_scene(const scene::Scene& scene, uint32_t object) {
  scene::Scene local;
  local.materials = scene.materials;
  local.group_count = scene.group_count;
  local.objects.push_back(scene.objects[object]);
  local.objects[0].movable = false;
  local.objects[0].pose = {};
  local.finish();
  return local;
}

}  // namespace

void each_ground(const World& s, Progress& progress,
                 const std::function<void(uint32_t, std::vector<uint32_t>, const scene::Scene&,
                                          const samples::Ground&)>& visit) {
  std::map<uint32_t, std::vector<uint32_t>> by_object;
  for (uint32_t i = 0; i < s.samples.size(); ++i) by_object[s.samples.attached[i]].push_back(i);
  visit(scene::kNone, std::move(by_object[scene::kNone]), s.scene,
        samples::Ground{s.scene, *s.caster, 0, s.scene.first_world()});
  for (auto& [object, ids] : by_object) {
    if (object == scene::kNone) continue;
    const scene::Scene local = local_scene(s.scene, object);
    const trace::RayCaster caster(local, progress);
    const uint32_t first = s.scene.objects[object].first_primitive;
    visit(object, std::move(ids), local, samples::Ground{s.scene, caster, first, kEverywhere});
  }
}

}  // namespace deltalux::session
