// SPDX-License-Identifier: Apache-2.0
// The layer of gather rays: what they aim at, what they met, and the light that they bring.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/archive.h"
#include "base/progress.h"
#include "gather/aim/sample_rays.h"
#include "gather/aim/suns.h"
#include "gather/choose/lit_cells.h"
#include "gather/hits/evaluate.h"
#include "gather/hits/gather_hits.h"
#include "session/cells/cell_layer.h"
#include "session/direct/direct_layer.h"
#include "session/world/lanes.h"
#include "session/world/world.h"

namespace deltalux::session {

/// The gathered light that a display shows during a drag; nothing else depends on it.
struct Glance {
  std::vector<std::array<double, 3>> irradiance;  ///< per sample
  bool stale = true;                              ///< all samples have to be read
  size_t turn = 0;
  size_t bytes() const { return irradiance.capacity() * sizeof(std::array<double, 3>); }
};

/// Without a final gather there are no rays.
struct RayLayer {
  RayLayer(const World& w, const DirectLayer& d, CellLayer& c)
      : world(w), direct(d), cells(c), hits({}, w.options.seed) {}

  const World& world;
  const DirectLayer& direct;  ///< has the receivers
  CellLayer& cells;
  gather::Guiding guiding;  ///< its guides are fixed at the bake
  gather::GatherHits hits;
  gather::Beams beams;
  gather::Suns suns{};
  Glance glance{};

  /// By light: 1 if gather rays get its direct light by shadow rays, so that cells leave it out.
  std::vector<uint8_t> lights_by_shadow_ray() const;
  /// What rays of these receivers depend on; or those of all samples.
  gather::Context context(std::span<const direct::Receiver> receivers,
                          const gather::Guiding& by) const {
    return {world.scene, *world.caster, world.lights, receivers, cells.division, by, beams, suns};
  }
  gather::Context context() const { return context(direct.receivers, guiding); }
  /// The cells that send light at present.
  gather::LitCells lit_cells(const gather::Evaluation& now) const {
    return {context(), now, cells.coverage.covered()};
  }
  /// The light of all cells at present. Brings the caches of cells and hits up to date.
  gather::Evaluation evaluation(bool errors);
  /// Receivers at points of the present scene.
  std::vector<direct::Receiver> receivers_at(std::span<const Vec3f> points,
                                             std::span<const Vec3f> normals) const;

  /// Places beams and suns in the present scene.
  void place();
  /// The targets that receivers see, where `rays` is the standard number; empty if there are none.
  std::vector<gather::SeenTargets> targets_at(std::span<const direct::Receiver> receivers,
                                              uint32_t rays, Progress& progress) const;
  std::vector<gather::SeenTargets> targets_of_samples(Progress& progress) const;
  /// How many rays of receivers aim at each of the targets that they see.
  std::vector<gather::RayAllotment> allotments_of(std::span<const gather::SeenTargets> seen,
                                                  const gather::RayCounts& rays) const;
  /// The guides, with the allotments of receivers that see these targets.
  gather::Guiding guiding_of(std::span<const gather::SeenTargets> seen,
                             const gather::RayCounts& rays) const;
  /// The hits of all samples before they are cast; allots their rays to the targets seen.
  gather::GatherHits uncast(std::span<const gather::SeenTargets> seen);
  /// Casts the rays of all samples. Throws Cancelled.
  void cast(Progress& progress);
  /// What rays of other receivers meet, ready to be read by `now`.
  gather::GatherHits hits_of(std::span<const direct::Receiver> receivers, const gather::Guiding& by,
                             const gather::RayCounts& rays, uint64_t seed,
                             const gather::Evaluation& now) const;
  /// Whether the rays of all samples are cast.
  bool all_cast() const { return !world.gathers() || hits.samples() == world.samples.size(); }

  /// Marks the rays that an edit may have changed, and completes `change` by what beams tell.
  void note(gather::Change& change);
  /// Casts marked rays again as long as more() is true, see GatherHits::follow().
  gather::GatherHits::Cast follow(Progress& progress, const std::function<bool()>& more);
  double pending_share() const { return world.gathers() ? hits.pending_share() : 0.0; }

  /// Forgets all rays, but not the guides.
  void clear();
  size_t bytes() const { return hits.bytes() + beams.bytes() + glance.bytes() + guiding.bytes(); }
  void digest(Lanes& lanes) const;
  void save(ArchiveView& archive) const;
  /// Restores guides and numbers of rays; then, once cells have their light, what rays met. Throw
  /// FormatError, Cancelled.
  void restore_choices(ArchiveSource& archive);
  void restore(ArchiveSource& archive, Progress& progress);

 private:
  /// How the sample divides its rays among the targets that it sees.
  gather::RayAllotment allotment(const gather::Targets& targets, size_t sample) const;
  /// Marks samples whose allotments change where beams were moved.
  void note_beams(gather::Change& change);
};

}  // namespace deltalux::session
