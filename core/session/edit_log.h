// SPDX-License-Identifier: Apache-2.0
// Edits as a transaction: what they change before any path is replaced, and how to take it back.
#pragma once
#include <span>
#include <utility>
#include <vector>

#include "scene/edit.h"
#include "session/affected.h"
#include "session/state.h"

namespace deltalux::session {

class EditLog {
 public:
  /// Copies what edits may change.
  explicit EditLog(State& state);

  /// Puts scene, factors, lights and acceleration structures into the state after `edits`, which
  /// were checked. May fail at any point: undo() then.
  void apply(std::span<const scene::Edit> edits);
  /// As before apply(). Needs no memory.
  void undo() noexcept;

  /// Of objects that really differ; those that moved while absent, too.
  const std::vector<ObjectChange>& changes() const { return changes_; }
  /// 1 per material whose reflectance differs; empty: none.
  const std::vector<uint8_t>& materials() const { return materials_; }
  bool reflects_more() const { return reflects_more_; }
  size_t old_lights() const { return old_lights_; }
  /// The first lights of a dark session have come: its scales are new.
  bool first_light() const { return first_light_; }
  /// Whether all paths of an old light start anew.
  bool reborn(size_t light) const;

 private:
  void set(std::span<const scene::Edit> edits);
  void place_lights();
  void place_objects();
  void add_lights();
  bool differs(uint32_t object) const;

  State& s_;
  std::vector<double> old_factors_;
  std::vector<scene::Material> old_materials_;
  std::vector<std::pair<Pose, bool>> old_objects_;
  std::vector<std::pair<size_t, trace::Light>> old_placed_;
  std::vector<trace::RayCaster::Saved> old_structures_;
  size_t old_lights_;
  trace::EnergyScale old_scale_;
  std::vector<ObjectChange> changes_;
  std::vector<uint8_t> materials_;
  bool reflects_more_ = false, first_light_ = false;
};

/// The lights of `object` of `scene`, with the paths that they get beside those of `state`: as
/// bright as the others', so that noise stays even, but as many as a group gets at the least, since
/// the others may be dimmed. Throws SceneError.
std::vector<trace::Light> added_lights(const State& state, const scene::Scene& scene,
                                       uint32_t object);

}  // namespace deltalux::session
