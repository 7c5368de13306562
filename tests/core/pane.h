// SPDX-License-Identifier: Apache-2.0
// A kind of surface that no scene has: a pane of glass, which lets a part of the light pass
// straight and absorbs the rest. For tests of lobes.
#pragma once
#include <algorithm>
#include <cmath>

#include "scene/scene.h"

namespace deltalux::surfaces {

/// Its parameter is the share of light that passes at a right angle.
class Pane final : public Kind {
 public:
  Pane() : Kind(Reads::nothing) {}
  std::string_view name() const override { return "pane"; }
  const char* flaw(std::span<const float> parameters) const override {
    const bool sound = parameters.size() == 1 && parameters[0] > 0 && parameters[0] <= 1;
    return sound ? nullptr : "other parameters than the share that passes";
  }
  bool is_opaque(const Surface&) const override { return true; }
  bool stops(const Surface&, const SurfacePoint&) const override { return true; }
  Vec3f tint(const Surface&, const SurfacePoint&) const override { return {0, 0, 0}; }
  Vec3f max_tint(const Surface&) const override { return {1, 1, 1}; }
  bool transmits(const Surface&) const override { return true; }
  float onward_chance(const Surface&, const Arrival&) const override { return 1; }
  bool onward(const Surface& surface, const Arrival& arrival, float, float,
              Onward& out) const override {
    out = {Lobe::straight, {}, arrival.direction, Vec3f{1, 1, 1} * transmittance(surface, arrival)};
    return true;
  }
  float transmittance(const Surface& surface, const Arrival& arrival) const override {
    const float cosine = std::fabs(dot(normalize(arrival.normal), arrival.direction));
    return std::pow(surface.parameters[0], 1 / std::max(cosine, 0.01f));
  }
  bool scatter(const Surface& surface, const Arrival& arrival, const BounceRandom& random,
               Departure& out) const override {
    if (!(random(kSurvive) < transmittance(surface, arrival))) return false;
    out.lobe = Lobe::straight;
    out.direction = arrival.direction;
    out.throughput = {1, 1, 1};
    return true;
  }
  Vec3d max_throughput(const Surface&) const override { return {1, 1, 1}; }
};

inline Surface pane(float passes) {
  static const Pane kind;
  return {{}, {}, false, &kind, {passes}, "pane"};
}

}  // namespace deltalux::surfaces
