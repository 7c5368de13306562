// SPDX-License-Identifier: Apache-2.0
// Traces a few paths of a light, and finds what they contribute to given points.
#pragma once
#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "base/random.h"
#include "direct/light_shape.h"
#include "estimate/disc_index/disc_index.h"
#include "samples/sample_set.h"
#include "scene/scene.h"
#include "trace/lights.h"
#include "trace/ray_caster.h"
#include "trace/scatter.h"
#include "trace/walk.h"

namespace deltalux::plan {

class LightPilot {
 public:
  static constexpr uint32_t kBounces = 16;
  static constexpr uint32_t kChunk = 16;  ///< paths whose contributions are separated at a time

  /// Keeps references to scene and caster, of which it only sees static geometry. `places`: where
  /// it measures, see pilot_points(). Throws Cancelled.
  LightPilot(const scene::Scene& scene, const trace::RayCaster& caster, samples::SampleSet places,
             const Workers& workers, Progress& progress);

  size_t points() const { return index_.discs().size(); }
  const samples::SampleSet& places() const { return places_; }
  const scene::Scene& scene() const { return scene_; }
  const trace::RayCaster& caster() const { return caster_; }

  /// A point just above the surface at a place.
  Vec3f above(size_t place) const {
    return places_.point[place] + places_.normal[place] * (places_.radius[place] * 0.01f);
  }
  static constexpr uint32_t kWalks = 4;  ///< from each place, see follow_back()
  static constexpr uint32_t kBack = 3;   ///< flights of such a walk
  /// Follows a few light paths backwards from a place: light there comes from where these go. Calls
  /// visit(at, normal, primitive, flight, random) at each vertex; `flight` counts from 0 in each
  /// walk, and dimensions of `random` from 2 on are free.
  template <class Visit>
  void follow_back(size_t place, uint64_t seed, const Visit& visit) const {
    for (uint32_t walk = 0; walk < kWalks; ++walk) {
      const PathRandom random(seed + walk, place);
      Vec3f at = above(place), normal = places_.normal[place];
      for (uint32_t flight = 0; flight < kBack; ++flight) {
        const Vec3f w = cosine_direction(normal, random(flight, 0), random(flight, 1));
        const trace::Hit hit = caster_.closest_static(at, w);
        if (!hit.valid()) break;
        normal = trace::facing_normal(hit, w);
        at = trace::leave_surface(at, w, hit, normal, scene_.slack_of(hit.primitive));
        visit(at, normal, hit.primitive, flight, random);
      }
    }
  }

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

  const scene::Scene& scene_;
  const trace::RayCaster& caster_;
  samples::SampleSet places_;
  estimate::DiscIndex index_;
};

}  // namespace deltalux::plan
