// SPDX-License-Identifier: Apache-2.0
// Light at arbitrary points, such as the pixels of an image, and what is kept of it between edits.
#pragma once
#include <memory>
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/images/kept_places.h"
#include "session/rays/ray_layer.h"

namespace deltalux::session {

/// What to compute at points.
struct Asked {
  uint32_t rays = 0;     ///< gather rays per point; 0: as many as the session uses
  bool by_need = false;  ///< see direct::light_by_need
  /// Keep what gather rays met, and direct light, for the next call, up to this many bytes.
  size_t keep_bytes = 0;
};

/// Nothing of it is saved or in the digest: a later call returns the same bits without what is
/// kept.
struct ImageLayer {
  explicit ImageLayer(RayLayer& r) : world(r.world), rays(r) {}

  const World& world;
  RayLayer& rays;
  std::unique_ptr<KeptPlaces> kept;  ///< null if nothing is

  /// Direct and indirect irradiance at points, each x 3. A null output is not computed. `noise`:
  /// one number per point, the standard error of the indirect light's sum of channels, due to the
  /// random choice of rays alone; somewhat overestimated. Throws Cancelled.
  void gather_at(std::span<const Vec3f> points, std::span<const Vec3f> normals, const Asked& asked,
                 double* direct, double* indirect, double* noise, Progress& progress);
  /// Records an edit that RayLayer::note() completed.
  void note(const gather::Change& change) {
    if (kept) kept->note(change);
  }
  size_t bytes() const { return kept ? kept->bytes() : 0; }

 private:
  /// Brings what is kept to the present state. If it throws, nothing is kept any more.
  void follow(const gather::Evaluation& now, Progress& progress);
  /// Casts the gather rays of receivers. `direct`: their direct light.
  std::unique_ptr<KeptPlaces::Batch> cast_from(std::vector<direct::Receiver> receivers,
                                               std::span<const Vec3d> direct, uint32_t count,
                                               const gather::Evaluation& now) const;
  /// Direct light of receivers, from `from` where it is there; `from` may be null.
  std::vector<Vec3d> direct_of(std::span<const direct::Receiver> receivers, bool by_need,
                               KeptPlaces* from, Progress& progress) const;
  /// GatherHits receivers up among what is kept; a place counts as found only if its ray count
  /// still suits the present light. `from` must be up to date.
  std::vector<KeptPlaces::Place> find(const KeptPlaces& from,
                                      std::span<const direct::Receiver> receivers,
                                      std::span<const Vec3d> direct, uint32_t count,
                                      const gather::Evaluation& now) const;
  /// Indirect irradiance and noise of receivers, from kept rays or new ones; `from` and `noise` may
  /// be null.
  void indirect_at(std::span<const direct::Receiver> receivers, std::span<const Vec3d> direct,
                   uint32_t count, const gather::Evaluation& now, KeptPlaces* from,
                   double* indirect, double* noise) const;
  /// The dim factor of each light's group.
  std::vector<double> dim_of_lights() const;
};

}  // namespace deltalux::session
