// SPDX-License-Identifier: Apache-2.0
// Builds new lights and acceleration structures aside first, where that can fail, so that undo()
// only swaps the old ones back.
#include "session/flow/edit_log.h"

#include <algorithm>
#include <cmath>

#include "base/assertion.h"

namespace deltalux::session {

EditLog::EditLog(State& state)
    : s_(state),
      old_factors_(state.group_factor),
      old_materials_(state.scene.materials),
      old_lights_(state.lights.size()),
      old_world_(state.scene.world()),
      old_scale_(state.scale),
      old_sum_groups_(state.sum_groups.size()) {
  for (const scene::Object& object : state.scene.objects)
    old_objects_.emplace_back(object.pose, object.present);
}

bool EditLog::differs(uint32_t object) const {
  if (object >= old_objects_.size()) return true;
  const scene::Object& now = s_.scene.objects[object];
  return now.pose != old_objects_[object].first || now.present != old_objects_[object].second;
}

void EditLog::apply(std::span<const scene::Edit> edits) {
  set(edits);
  fit_world();
  place_lights();
  if (s_.caster) place_objects();
  first_lights_ = s_.add_lights(uint32_t(old_objects_.size()));
  find_change();
  changes_world_ = !(s_.scene.world() == old_world_);
}

void EditLog::set(std::span<const scene::Edit> edits) {
  scene::Scene& scene = s_.scene;
  for (const scene::Edit& edit : edits) {
    if (const auto* move = std::get_if<scene::Move>(&edit)) {
      DELTALUX_ASSERT(scene.objects[move->object].movable);
      scene.objects[move->object].pose = move->pose;
    } else if (const auto* presence = std::get_if<scene::SetPresent>(&edit)) {
      DELTALUX_ASSERT(scene.objects[presence->object].movable);
      scene.objects[presence->object].present = presence->present;
    } else if (const auto* dim = std::get_if<scene::Dim>(&edit)) {
      DELTALUX_ASSERT(dim->group < s_.group_factor.size() && dim->factor >= 0);
      s_.group_factor[dim->group] = dim->factor;
    } else if (const auto* paint = std::get_if<scene::SetReflectance>(&edit)) {
      DELTALUX_ASSERT(paint->material < scene.materials.size());
      scene.materials[paint->material].reflectance = paint->reflectance;
    } else if (const auto* insert = std::get_if<scene::Insert>(&edit)) {
      scene.add_object(insert->object);
      s_.group_factor.resize(scene.group_count, 1.0);
    }
  }
  for (size_t m = 0; m < old_materials_.size(); ++m) {
    const Vec3f now = scene.materials[m].reflectance, before = old_materials_[m].reflectance;
    if (now == before) continue;
    materials_.resize(old_materials_.size(), 0);
    materials_[m] = 1;
    reflects_more_ |= now.x > before.x || now.y > before.y || now.z > before.z;
  }
}

void EditLog::fit_world() {
  const Box& first = s_.scene.first_world();
  bool inside = old_world_ == first;
  for (uint32_t i = 0; inside && i < s_.scene.objects.size(); ++i) {
    const scene::Object& own = s_.scene.objects[i];
    if (own.present && differs(i)) inside = first.contains(s_.bounds_at(i, own.pose));
  }
  if (!inside) s_.hold_objects();
}

void EditLog::place_lights() {
  for (size_t l = 0; l < s_.lights.size(); ++l) {
    trace::Light& light = s_.lights[l];
    if (light.object == scene::kNone || !differs(light.object)) continue;
    trace::Light placed = light;
    trace::place_light(s_.scene, placed);
    old_placed_.emplace_back(l, std::move(placed));
    std::swap(light, old_placed_.back().second);
  }
}

void EditLog::place_objects() {
  for (uint32_t i = 0; i < s_.scene.objects.size(); ++i) {
    if (!differs(i)) continue;
    const bool fresh = i >= old_objects_.size();
    if (!fresh) old_structures_.push_back(s_.caster->save_object(i));
    ObjectChange& change = changes_.emplace_back(i);
    if (fresh) continue;
    change.before = s_.caster->object_bounds(i);
    change.parts_before = s_.caster->part_bounds(i);
  }
  for (const ObjectChange& change : changes_) s_.caster->update_object(s_.scene, change.object);
  // All objects must be there before: new ones may widen the bounds of others.
  for (ObjectChange& change : changes_) {
    change.after = s_.caster->object_bounds(change.object);
    change.parts_after = s_.caster->part_bounds(change.object);
  }
}

void EditLog::find_change() {
  for (const ObjectChange& c : changes_) {
    std::vector<Box> parts = c.parts_before;
    parts.insert(parts.end(), c.parts_after.begin(), c.parts_after.end());
    change_.objects.push_back(
        {c.object, boxes_of({&c, 1}), c.after, std::move(parts), c.parts_after});
  }
  change_.lights.assign(s_.lights.size(), 0);
  for (const auto& [l, before] : old_placed_) {
    change_.lights[l] = !trace::sends_alike(before, s_.lights[l]);
    if (change_.lights[l]) change_.before.push_back(before);
  }
  std::fill(change_.lights.begin() + long(old_lights_), change_.lights.end(), uint8_t(1));
}

bool EditLog::reborn(size_t l) const {
  const trace::Light& light = s_.lights[l];
  const double factor = old_factors_[light.group];
  const bool merged = World::merged(light.group, old_factors_.size());
  return change_.changes(uint32_t(l)) || s_.birth_factor(light) != (merged ? factor : 1.0);
}

void EditLog::undo() noexcept {
  s_.group_factor = std::move(old_factors_);
  s_.scene.materials = std::move(old_materials_);
  s_.scale = old_scale_;
  s_.lights.erase(s_.lights.begin() + long(old_lights_), s_.lights.end());
  s_.sum_groups.resize(old_sum_groups_);
  if (s_.light_sampled.size() > old_lights_) s_.light_sampled.resize(old_lights_);
  for (auto& [l, light] : old_placed_) std::swap(s_.lights[l], light);
  for (size_t i = 0; i < old_objects_.size(); ++i) {
    s_.scene.objects[i].pose = old_objects_[i].first;
    s_.scene.objects[i].present = old_objects_[i].second;
  }
  while (s_.scene.objects.size() > old_objects_.size()) s_.scene.drop_last_object();
  s_.scene.group_count = uint32_t(s_.group_factor.size());
  s_.scene.hold(old_world_);
  if (!s_.caster) return;
  s_.caster->drop_objects(old_objects_.size());
  for (trace::RayCaster::Saved& saved : old_structures_) s_.caster->put_back(std::move(saved));
}

}  // namespace deltalux::session
