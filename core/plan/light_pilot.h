// SPDX-License-Identifier: Apache-2.0
// Traces a few paths of a light, and finds what they contribute to points distributed evenly over
// the static surfaces.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "estimate/disc_index/disc_index.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/walk.h"

namespace deltalux::plan {

/// Points distributed by area over the front sides of the static surfaces, with radii of discs.
samples::SampleSet surface_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                  uint32_t count);

class LightPilot {
 public:
  static constexpr uint32_t kBounces = 16;
  static constexpr uint32_t kChunk = 16;  ///< paths whose contributions are separated at a time

  /// Only sees static geometry and `reflectance` (per material). Throws Cancelled.
  LightPilot(const scene::Scene& scene, std::span<const Vec3f> reflectance,
             const trace::RayCaster& caster, const Workers& workers, Progress& progress);

  size_t points() const { return index_.discs().size(); }
  const scene::Scene& scene() const { return scene_; }
  const trace::RayCaster& caster() const { return caster_; }

  /// Photopic irradiance from paths at the points, up to a factor common to all lights.
  struct Given {
    std::vector<double> all;  ///< direct and indirect
    /// each path times its weight, that is, mean squares, for the noise
    std::vector<double> indirect;
  };
  /// Traces light.path_count paths of the light, with path numbers from light.first_path.
  Given given(const trace::Light& light) const;
  /// For each of at most kChunk paths with the given starts: its indirect light, weighted by point
  /// and summed over points.
  void brought(const trace::Light& light, std::span<const trace::Emission> starts, uint64_t first,
               std::span<const double> weight, double* out) const;

 private:
  struct Flights;
  trace::Walk walk(uint32_t batches) const;

  scene::Scene scene_;
  const trace::RayCaster& caster_;
  estimate::DiscIndex index_;
};

}  // namespace deltalux::plan
