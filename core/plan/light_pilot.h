// SPDX-License-Identifier: Apache-2.0
// A few paths of a light, and what they bring to points spread evenly over the static surfaces.
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

/// Points spread by area over the front sides of the static surfaces, discs' radii included.
samples::SampleSet surface_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                  uint32_t count);

class LightPilot {
 public:
  static constexpr uint32_t kBounces = 16;
  static constexpr uint32_t kChunk = 16;  ///< paths that are told apart at once

  /// Sees static geometry and `reflectance` (per material) alone. Throws Cancelled.
  LightPilot(const scene::Scene& scene, std::span<const Vec3f> reflectance,
             const trace::RayCaster& caster, const Workers& workers, Progress& progress);

  size_t points() const { return index_.discs().size(); }
  const scene::Scene& scene() const { return scene_; }
  const trace::RayCaster& caster() const { return caster_; }

  /// Photopic irradiance of paths at the points, up to a factor that all lights share.
  struct Given {
    std::vector<double> all;       ///< direct and indirect
    std::vector<double> indirect;  ///< each path times its weight: mean squares, for the noise
  };
  /// By light.path_count paths of the light, which are numbered by light.first_path.
  Given given(const trace::Light& light) const;
  /// Indirect light of single paths that begin so, at most kChunk, each weighed by point and
  /// summed.
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
