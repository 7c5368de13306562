// SPDX-License-Identifier: Apache-2.0
// All data of a session, in layers. A bake fills a new state; edits change it.
#pragma once
#include <algorithm>
#include <cstdint>
#include <utility>

#include "session/cells/cell_layer.h"
#include "session/direct/direct_layer.h"
#include "session/discs/disc_layer.h"
#include "session/images/image_layer.h"
#include "session/paths/path_layer.h"
#include "session/rays/ray_layer.h"
#include "session/state/sharing.h"
#include "session/world/world.h"

namespace deltalux::session {

/// Expected memory, from a few pilot paths and pilot rays.
struct Forecast {
  uint64_t segments = 0;
  size_t bytes = 0;
  double bytes_per_path = 0;
  uint64_t paths_that_fit = 0;
  gather::GatherHits::PerRay per_ray;  ///< of sessions with a final gather
};

/// How far an update is. Only at rest, results may be read: sums, marks and scene belong together.
enum class Step : uint8_t {
  rest,
  applied,   ///< the scene is the new one, and what that affects is found
  marked,    ///< affected paths are cut and wait
  replaced,  ///< as many of them as were asked for are traced again
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
  CellLayer cells{*this};
  RayLayer rays{*this, direct, cells};
  ImageLayer images{rays};
  Sharing sharing;
  Forecast forecast;
  uint64_t edits = 0;  ///< number of edits in effect since the bake
  bool baked = false;
  bool damaged = false;  ///< an update failed in the middle, and so did computing all again
  Step step = Step::rest;

  /// Takes over what a bake chose, which edits and recomputations keep. Both states have the same
  /// scene, samples and lights.
  void take_choices(const State& other) {
    path_shares = other.path_shares;
    light_sampled = other.light_sampled;
    slack = other.slack;
    largest_radius = other.largest_radius;
    discs.take_choices(other.discs);
    direct.scales = other.direct.scales;
    rays.guiding = other.rays.guiding;
    forecast = other.forecast;
    edits = other.edits;
  }
  /// Goes on to the next step of an update.
  void enter(Step from, Step next) {
    DELTALUX_ASSERT(step == from);
    step = next;
  }
  /// Lays out all sums for the present objects and light groups; shrink_sums(): after a failed edit
  /// had added some.
  void grow_sums(const Progress& progress) {
    cells.grow(progress);
    lay_out_sums();
  }
  void shrink_sums() noexcept {
    lay_out_sums();
    cells.shrink();
  }
  /// Whether the sums of all paths are here, in a session without paths.
  bool has_all_sums() const { return sharing.added_paths() == options.paths; }
  /// Counts edits that took effect; `complete`: whether the sums of all paths were there before.
  void count_edits(size_t count, bool complete) {
    if (!count) return;
    if (complete) sharing.added_since = edits;
    edits += count;
    sharing.added.clear();
    sharing.choices.reset();
  }
  /// The share of an update's work that remains: the largest of those of paths, direct light and
  /// gather rays.
  double pending_share() const {
    return std::max({direct.pending_share(), rays.pending_share(), paths.pending_share()});
  }
  /// Bytes without spare discs: whether an edit is admitted does not depend on these.
  size_t needed_bytes() const {
    return paths.bytes() + discs.bytes() + direct.bytes() + cells.bytes() + rays.bytes() +
           images.bytes() + sharing.bytes() + (sharing.choices ? sharing.choices->bytes() : 0);
  }
  size_t bytes() const { return needed_bytes() + (discs.spare ? discs.spare->bytes() : 0); }

 private:
  /// Lays out the sums on discs, and what others were told of them.
  void lay_out_sums() {
    if (sharing.sent) sharing.sent->set_groups(cell_groups());
    discs.lay_out_sums();
  }
};

/// Throws Error if an update failed in the middle and so did computing all again, so that there is
/// no valid state.
void check_whole(const State& state);
/// Throws OptionError in a session without paths that lacks sums of some.
void check_added(const State& state);
/// Throws OptionError in a session without paths before its gather rays are cast, or before others
/// gave what direct light was left to them.
void check_gathered(const State& state);
/// Throws OptionError, or Error as check_whole() does, unless there is light to read.
void check_readable(const State& state);

}  // namespace deltalux::session
