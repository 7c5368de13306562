// SPDX-License-Identifier: Apache-2.0
// The segments count in any order, all else in a fixed one.
#include "session/read/digest.h"

#include <optional>

#include "base/error.h"
#include "session/world/lanes.h"

namespace deltalux::session {
namespace {

void chain_scene(Lanes& lanes, const State& s) {
  for (uint32_t i = 0; i < s.scene.objects.size(); ++i) {
    const scene::Object& object = s.scene.objects[i];
    if (!object.movable) continue;
    lanes.chain(object.present);
    for (const Vec3d& row : object.pose.row)
      for (int axis = 0; axis < 3; ++axis) lanes.chain(bits(row[axis]));
    for (int axis = 0; axis < 3; ++axis) lanes.chain(bits(object.pose.translation[axis]));
    lanes.chain(s.caster->object_bounds(i));
  }
  lanes.chain(s.scene.world());
  lanes.chain(bits(s.caster->margin()));
  lanes.chain_all(s.group_factor);
  for (const scene::Material& material : s.scene.materials) lanes.chain(material.reflectance);
}

void chain_lights(Lanes& lanes, const State& s) {
  for (const trace::Light& light : s.lights) {
    lanes.chain(light.first_path), lanes.chain(light.path_count);
    lanes.chain(uint64_t(light.on) << 32 | light.group), lanes.chain(uint64_t(light.finer));
    for (int c = 0; c < 3; ++c) lanes.chain(bits(light.power[c]));
    if (light.map)
      for (const trace::SunMap::Leaf& leaf : light.map->leaves)
        lanes.chain(Vec3f{leaf.u, leaf.v, leaf.size}), lanes.chain(bits(leaf.below));
    if (!light.aims) continue;
    for (const trace::AimMap::Target& target : light.aims->targets)
      lanes.chain(target.centre), lanes.chain(bits(target.radius));
    for (const float below : light.aims->below) lanes.chain(bits(below));
  }
  lanes.chain_all(s.light_sampled);
  lanes.chain(bits(s.scale.quantum));
  lanes.chain(uint64_t(s.scale.digits));
  if (s.direct.scales) lanes.chain(bits(s.direct.scales->quantum));
  lanes.chain_all(s.slack);
}

}  // namespace

std::array<uint64_t, 4> digest(const State& s, const std::optional<SegmentsHash>& others) {
  check_whole(s);
  check_added(s);
  check_gathered(s);
  if (s.holds_none() && s.all_paths() && !others)
    throw OptionError(
        "digest: the segments are in other sessions; give the sum of their segments_hash");
  const SegmentsHash own = s.paths.hash();
  Lanes all{own.a, own.b};
  if (others) all.merge({others->a, others->b});
  Lanes ordered = all;
  s.discs.digest(ordered);
  s.direct.digest(ordered);
  s.cells.digest(ordered);
  s.rays.digest(ordered);
  chain_lights(ordered, s);
  chain_scene(ordered, s);
  return {all.a, all.b, ordered.a, ordered.b};
}

}  // namespace deltalux::session
