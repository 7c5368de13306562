// SPDX-License-Identifier: Apache-2.0
// Traces a few paths of a light, and finds what they contribute to given points.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "direct/light_shape.h"
#include "estimate/disc_index/disc_index.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/walk.h"

namespace deltalux::plan {

class LightPilot {
 public:
  static constexpr uint32_t kBounces = 16;
  static constexpr uint32_t kChunk = 16;  ///< paths whose contributions are separated at a time

  /// Only sees static geometry and `reflectance` (per material). `places`: where it measures, see
  /// pilot_points(). Throws Cancelled.
  LightPilot(const scene::Scene& scene, std::span<const Vec3f> reflectance,
             const trace::RayCaster& caster, samples::SampleSet places, const Workers& workers,
             Progress& progress);

  size_t points() const { return index_.discs().size(); }
  const samples::SampleSet& places() const { return places_; }
  const scene::Scene& scene() const { return scene_; }
  const trace::RayCaster& caster() const { return caster_; }

  /// Photopic power on the points' discs, which all have the same area.
  struct Given {
    std::vector<double> all;  ///< direct and indirect
    /// each path times its weight, that is, mean squares, for the noise
    std::vector<double> indirect;
  };
  /// Traces light.path_count paths of the light, with path numbers from light.first_path. `wide`:
  /// whether hardly any of these reach a place straight away, so that its direct light comes from
  /// shadow rays instead.
  Given given(const trace::Light& light, bool wide) const;
  /// For each of at most kChunk paths with the given starts: its indirect light, weighted by point
  /// and summed over points.
  void brought(const trace::Light& light, std::span<const trace::Emission> starts, uint64_t first,
               std::span<const double> weight, double* out) const;

 private:
  struct Flights;
  trace::Walk walk(uint32_t batches) const;
  /// Unscattered power of a light on the disc of a place, by a few shadow rays.
  double shines(const direct::LightShape& shape, Vec3f strength, size_t place) const;

  scene::Scene scene_;
  const trace::RayCaster& caster_;
  samples::SampleSet places_;
  estimate::DiscIndex index_;
};

}  // namespace deltalux::plan
