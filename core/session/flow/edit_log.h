// SPDX-License-Identifier: Apache-2.0
// Applies edits as one transaction: changes everything that must change before any path is
// replaced, and can undo it.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "scene/edit.h"
#include "session/flow/affected.h"
#include "session/state/state.h"

namespace deltalux::session {

class EditLog {
 public:
  /// Copies all that edits may change.
  explicit EditLog(State& state);

  /// Brings scene, dim factors, lights and acceleration structures into the state after `edits`,
  /// which must have passed Session::check(). May fail at any point; then call undo().
  void apply(std::span<const scene::Edit> edits);
  /// Whether the edits change Scene::world(), so that everything has to be computed again.
  bool changes_world() const { return changes_world_; }
  /// Restores the state before apply(). Allocates no memory.
  void undo() noexcept;

  /// The objects whose pose or presence differs; includes objects that moved while absent.
  const std::vector<ObjectChange>& changes() const { return changes_; }
  /// The same, with the lights whose emission differs, new ones included.
  const trace::Change& change() const { return change_; }
  /// 1 for each material whose reflectance differs; empty if there is none.
  const std::vector<uint8_t>& materials() const { return materials_; }
  /// Whether some material reflects more in some channel, so that paths may become longer.
  bool reflects_more() const { return reflects_more_; }
  /// Number of lights before the edits; new lights follow them.
  size_t old_lights() const { return old_lights_; }
  /// If these edits bring the first lights into a scene without any: how many the first object with
  /// lights has, otherwise 0. The quanta of power are then new, and chosen by these lights alone,
  /// as if others came later.
  size_t first_lights() const { return first_lights_; }
  /// Whether all paths of this old light must be traced anew from the light.
  bool reborn(size_t light) const;

 private:
  void set(std::span<const scene::Edit> edits);
  void fit_world();
  void place_lights();
  void place_objects();
  void find_change();
  /// Whether the object's pose or presence differs from that before apply(); true for new objects.
  bool differs(uint32_t object) const;

  State& s_;
  std::vector<double> old_factors_;
  std::vector<scene::Material> old_materials_;
  std::vector<std::pair<Pose, bool>> old_objects_;
  std::vector<std::pair<size_t, trace::Light>> old_placed_;
  std::vector<trace::RayCaster::Saved> old_structures_;
  size_t old_lights_;
  Box old_world_;
  trace::EnergyScale old_scale_;
  size_t old_sum_groups_;
  std::vector<ObjectChange> changes_;
  trace::Change change_;
  std::vector<uint8_t> materials_;
  bool reflects_more_ = false, changes_world_ = false;
  size_t first_lights_ = 0;
};

}  // namespace deltalux::session
