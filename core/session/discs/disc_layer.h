// SPDX-License-Identifier: Apache-2.0
// The layer of discs: those of all samples, in estimators of the chosen methods, the areas that
// they count, and the sums of what paths bring to them.
#pragma once
#include <cstdint>
#include <deque>
#include <memory>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "estimate/estimator.h"
#include "plan/pilot.h"
#include "plan/planner.h"
#include "session/paths/pilot_paths.h"
#include "session/world/lanes.h"
#include "session/world/object_change.h"
#include "session/world/world.h"

namespace deltalux::session {

/// The samples attached to one object, with discs and index in the object's local space.
struct MovingPart {
  uint32_t object = scene::kNone;
  /// Counts segments in local space; holds the discs.
  std::shared_ptr<const estimate::SignedEstimator> index;
  Box local;             ///< bounds of all discs in local space
  Box world;             ///< bounds of `local` in the present pose, conservative
  bool current = false;  ///< whether the sums are those of the present pose
};

/// Discs after their placement and before the choice of their methods.
struct PlacedDiscs {
  /// Of the static part, then of `moving`, in that order; or none.
  std::deque<plan::Pilot> pilots;
  std::vector<MovingPart> moving;  ///< without estimators
  std::vector<float> openness;     ///< by sample
};

/// Estimators of discs, static and moving, and what they count.
struct DiscSets {
  std::shared_ptr<const estimate::SignedEstimator> still;
  std::vector<MovingPart> moving;
  // By sample, see samples/openness.h; 1 where it does not count, or is not known yet.
  std::vector<float> openness;
  size_t bytes() const;
};

/// In a session that does not count in discs, there are no discs, and no sums.
struct DiscLayer : DiscSets {
  explicit DiscLayer(const World& w) : world(w) {}

  const World& world;
  /// For the static part, then for each movable that samples are attached to.
  std::vector<plan::PartPlan> plans;
  std::vector<float> area;         // by sample: the area that its disc counts at present
  bool openness_complete = false;  // in a session without paths: whether all parts told theirs
  std::vector<int64_t> sums;       // EnergySums, slab = group * kBatches + batch
  // Their marks: what changed since they were last told, see PathChanges; empty before that.
  std::vector<uint8_t> sum_marks;
  /// Discs of a session that does not count in them, once they were asked for.
  std::unique_ptr<DiscSets> spare;

  /// Places discs; radii must be known. `openness`: of each sample, where it is known, as from a
  /// session file; otherwise it is computed.
  PlacedDiscs place(Progress& progress, std::span<const float> openness_known = {}) const;
  void take(PlacedDiscs& placed, bool complete = false);
  /// Chooses methods where the options leave that to it: predicts how many segments the bake and
  /// the frames of a session bring to each part. `thorough`: the cost of every method is predicted.
  void plan(PlacedDiscs& placed, const PilotPaths& paths, bool thorough, Progress& progress);
  void make_estimators(PlacedDiscs& placed, Progress& progress);
  /// Takes over what a bake chose.
  void take_choices(const DiscLayer& other);

  /// Sums of nothing, for the present poses.
  void clear_sums();
  /// Places the moving parts; their sums are those of the present poses.
  void settle_parts();
  /// Lays out the sums for the present light groups; new ones are 0.
  void lay_out_sums();
  size_t sum_count() const {
    return world.counts_in_discs() ? size_t(world.slabs()) * world.samples.size() * 3 : 0;
  }
  size_t mark_count() const {
    return world.slabs() * estimate::EnergySums::marks_of_slab(world.samples.size());
  }
  estimate::EnergySums energy();
  /// Recomputes `part.world` from the object's pose.
  void place_part(MovingPart& part) const;
  void place_parts() {
    for (MovingPart& part : moving) place_part(part);
  }
  /// Clears the sums of the samples of `part`.
  void clear_part(const MovingPart& part);

  /// Whether `openness` has what this session computes, or is told.
  bool knows_openness() const {
    return openness_complete || !world.counts_openness() || !world.holds_none();
  }
  /// Recomputes what discs count: all of them, or those near `changes`, if anything counts in
  /// discs.
  void refresh_areas(const std::vector<ObjectChange>* changes);
  /// The same, also if nothing does.
  void find_areas(const std::vector<ObjectChange>* changes);

  void digest(Lanes& lanes) const;
  /// `choices`: what a bake chose and edits made of it; otherwise the sums. `own`: whether those
  /// of this session's paths, of which one without paths has none.
  void save_choices(ArchiveView& archive) const;
  void save(ArchiveView& archive, bool own) const;
  /// Restores discs and what they count; those of save_choices().
  PlacedDiscs restore_choices(ArchiveSource& archive, Progress& progress);
  /// Restores what save() wrote. `segments`: how many there are that the sums may count.
  void restore(ArchiveSource& archive, size_t segments);
  /// Memory without spare discs: whether an edit is admitted does not depend on these.
  size_t bytes() const;
};

/// Discs in the layer for as long as this lives, in a session that does not count in them.
class DiscsInPlace {
 public:
  /// `world`: that of the layer, whose radii may have to be chosen. Throws Cancelled.
  DiscsInPlace(World& world, DiscLayer& discs, Progress& progress);
  ~DiscsInPlace();
  DiscsInPlace(const DiscsInPlace&) = delete;
  DiscsInPlace& operator=(const DiscsInPlace&) = delete;

 private:
  void swap() noexcept { std::swap(static_cast<DiscSets&>(discs_), *discs_.spare); }

  DiscLayer& discs_;
  bool placed_ = false;
};

}  // namespace deltalux::session
