// SPDX-License-Identifier: Apache-2.0
// Base of kinds of surfaces that scatter light equally in all directions: each kind defines only
// the reflectance at a point, and where it has holes, if it has any.
#pragma once
#include "surfaces/kind.h"

namespace deltalux::surfaces {

/// What Kind::scatter() does at a diffuse point of this reflectance.
bool scatter_diffusely(Vec3f reflectance, const Arrival& arrival, const BounceRandom& random,
                       Departure& out);

class Lambertian : public Kind {
 public:
  bool is_opaque(const Surface&) const override { return true; }
  bool stops(const Surface&, const SurfacePoint&) const override { return true; }
  bool scatter(const Surface& surface, const Arrival& arrival, const BounceRandom& random,
               Departure& out) const final {
    return scatter_diffusely(surface.diffuse_at(arrival.at), arrival, random, out);
  }
  Vec3d max_throughput(const Surface& surface) const final;

 protected:
  using Kind::Kind;
};

}  // namespace deltalux::surfaces
