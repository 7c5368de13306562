// SPDX-License-Identifier: Apache-2.0
// A kind of surface that no scene has: a mirror that sends on a part of the light diffusely. For
// tests of lobes.
#pragma once
#include <algorithm>

#include "base/hemisphere.h"
#include "scene/scene.h"

namespace deltalux::surfaces {

/// Its parameter is the share of the reflected light that it mirrors.
class Mirror final : public Kind {
 public:
  Mirror() : Kind(Reads::nothing) {}
  std::string_view name() const override { return "mirror"; }
  const char* flaw(std::span<const float> parameters) const override {
    const bool sound = parameters.size() == 1 && parameters[0] > 0 && parameters[0] <= 1;
    return sound ? nullptr : "other parameters than the share that is mirrored";
  }
  bool is_opaque(const Surface&) const override { return true; }
  bool stops(const Surface&, const SurfacePoint&) const override { return true; }
  Vec3f tint(const Surface&, const SurfacePoint&) const override { return {1, 1, 1}; }
  Vec3f max_tint(const Surface&) const override { return {1, 1, 1}; }
  bool has_specular(const Surface&) const override { return true; }
  float diffuse_share(const Surface& surface, const SurfacePoint&) const override {
    return 1 - surface.parameters[0];
  }
  bool onward(const Surface&, const Arrival& arrival, float, float, Onward& out) const override {
    const Vec3f normal = facing(arrival.normal, arrival.direction);
    out = {Lobe::specular, normal, mirrored(arrival.direction, normal), {1, 1, 1}};
    return true;
  }
  bool scatter(const Surface& surface, const Arrival& arrival, const BounceRandom& random,
               Departure& out) const override {
    const Vec3f& reflectance = surface.reflectance;
    const float survival = std::max({reflectance.x, reflectance.y, reflectance.z});
    if (!(random(kSurvive) < survival)) return false;
    out.normal = facing(arrival.normal, arrival.direction);
    out.lobe = random(kMore) < surface.parameters[0] ? Lobe::specular : Lobe::diffuse;
    out.direction = out.lobe == Lobe::specular
                        ? mirrored(arrival.direction, out.normal)
                        : cosine_direction(out.normal, random(kScatterU), random(kScatterV));
    for (int c = 0; c < 3; ++c) out.throughput[c] = double(reflectance[c]) / double(survival);
    return true;
  }
  Vec3d max_throughput(const Surface&) const override { return {1, 1, 1}; }
};

inline Surface mirror(Vec3f reflectance, float mirrored = 1) {
  static const Mirror kind;
  return {reflectance, {}, false, &kind, {mirrored}, "mirror"};
}

}  // namespace deltalux::surfaces
