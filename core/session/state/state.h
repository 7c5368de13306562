// SPDX-License-Identifier: Apache-2.0
// All data of a session, in layers; only the functions of this folder change them.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "gather/looks/evaluate.h"
#include "session/direct/direct_layer.h"
#include "session/discs/disc_layer.h"
#include "session/paths/path_layer.h"
#include "session/world/world.h"

namespace deltalux::session {

/// The gathered light that a display shows during a drag; nothing else depends on it.
struct Glance {
  std::vector<std::array<double, 3>> irradiance;  ///< per sample
  bool stale = true;                              ///< all samples have to be read
  size_t turn = 0;
  size_t bytes() const { return irradiance.capacity() * sizeof(std::array<double, 3>); }
};

/// What sessions with a final gather hold in addition, see gather/.
struct Gather {
  gather::Cells cells;
  gather::CellSums sums;
  gather::CellLight light;  ///< as of the last read
  gather::Coverage coverage;
  gather::Looks looks;
  gather::Beams beams;
  gather::Suns suns{};
  Glance glance{};
};

/// The layers refer to the world of their own state, so that it is neither copied nor moved.
struct State : World {
  explicit State(const Options& o) : World(o) {}
  /// Throws SceneError, OptionError.
  State(scene::Scene given_scene, samples::SampleSet given_samples, const Options& asked)
      : World(std::move(given_scene), std::move(given_samples), asked) {}
  State(const State&) = delete;
  State& operator=(const State&) = delete;

  PathLayer paths{*this};
  DiscLayer discs{*this};
  DirectLayer direct{*this};
  uint64_t edits = 0;  // number of edits in effect since the bake
  // In a session without paths: the ranges of other sessions whose sums, of the present state, are
  // in these sums; and the edits in effect when those of all paths were, nullopt: never yet.
  std::vector<PathRange> added;
  std::optional<uint64_t> added_since;
  std::unique_ptr<Gather> gather;  // null without a final gather
  gather::Guiding guiding;         // for the final gather; its guides are fixed at the bake

  /// Takes over what a bake chose, which edits and recomputations keep. Both states have the same
  /// scene, samples and lights.
  void take_choices(const State& other) {
    light_sampled = other.light_sampled;
    slack = other.slack;
    largest_radius = other.largest_radius;
    discs.take_choices(other.discs);
    direct.scales = other.direct.scales;
    guiding = other.guiding;
    edits = other.edits;
  }
  /// By light: 1 if gather rays get its direct light by shadow rays, so that cells leave it out.
  std::vector<uint8_t> lights_by_shadow_ray() const { return lights_by_shadow_ray(guiding); }
  std::vector<uint8_t> lights_by_shadow_ray(const gather::Guiding& by) const {
    std::vector<uint8_t> asked(lights.size());
    for (const gather::BeamGuide& beam : by.beams) asked[beam.light] = 1;
    for (const uint32_t sun : by.suns) asked[sun] = 1;
    return asked;
  }
};

}  // namespace deltalux::session
