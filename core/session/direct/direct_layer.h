// SPDX-License-Identifier: Apache-2.0
// The layer of direct light by shadow rays: where the samples are, and what lights bring to them.
#pragma once
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "direct/direct_light.h"
#include "session/world/lanes.h"
#include "session/world/object_change.h"
#include "session/world/world.h"
#include "trace/change.h"

namespace deltalux::session {

struct DirectLayer {
  explicit DirectLayer(const World& w) : world(w) {}

  const World& world;
  std::optional<direct::Scales> scales;        // fixed at the bake
  std::unique_ptr<direct::DirectLight> light;  // null before the bake
  std::vector<direct::Receiver> receivers;     // per sample, in the present pose

  /// Recomputes `receivers`: all of them, or those on changed objects. `changed`: 1 for each
  /// changed object.
  void place(const std::vector<uint8_t>* changed = nullptr);
  /// Chooses scales by the lights as loaded.
  void choose_scales();
  /// Computes the light of all samples; at a bake, chooses scales. `leave`: lays it out, but leaves
  /// shadow rays to others.
  void compute(Progress& progress, bool leave = false);
  /// Follows an edit as far as the time budget allows. `old_lights`: how many there were before.
  /// Throws Cancelled, and leaves the light as it was.
  void update(const trace::Change& edit, std::span<const ObjectChange> changes, size_t old_lights,
              double budget_ms, Progress& progress);
  /// The share of it that is not up to date.
  double pending_share() const { return light ? 1 - light->current_share() : 0.0; }
  /// Direct light at other receivers. `lights`: 1 for each light to include.
  std::unique_ptr<direct::DirectLight> at(std::span<const direct::Receiver> others,
                                          std::span<const uint8_t> lights) const;
  size_t bytes() const {
    return receivers.capacity() * sizeof(direct::Receiver) + (light ? light->bytes() : 0);
  }
  void digest(Lanes& lanes) const;
  /// What a bake chose, and the light.
  void save_choices(ArchiveView& archive) const;
  void save(ArchiveView& archive) const;
  /// Restores what both saved.
  void restore(ArchiveSource& archive);

 private:
  double choose_reference() const;
  std::unique_ptr<direct::DirectLight> make() const;
  /// The receiver of a sample in its object's present pose.
  direct::Receiver receiver_of(size_t sample) const;
};

/// Irradiance of receivers [first, first + count), in the scene's unit; `factors` by light group.
std::vector<Vec3d> irradiance_of(const direct::DirectLight& light, std::span<const double> factors,
                                 size_t first, size_t count);

}  // namespace deltalux::session
