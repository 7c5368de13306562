// SPDX-License-Identifier: Apache-2.0
// Glass by Fresnel's equations, and what lies beside it.
#include "surfaces/pane.h"

#include <cmath>

#include "base/hemisphere.h"
#include "surfaces/lambertian.h"
#include "surfaces/textured.h"

namespace deltalux::surfaces {
namespace {

PaneParameters pane_of(std::span<const float> p) { return {p[0], p[1], p[2], p[3], p[4], p[5]}; }

/// What a pane is made of at a point.
PaneParameters pane_at(const Surface& surface, const SurfacePoint& at) {
  PaneParameters pane = pane_of(surface.parameters);
  if (!surface.map) return pane;
  if (const auto texel = texel_at(*surface.map, at)) pane.coverage *= texel->weight;
  return pane;
}

float diffuse_share_of(const PaneParameters& pane) {
  return pane.coverage - pane.coverage * pane.transmission;
}

/// Shares of light that glass mirrors and lets pass, without its tint.
struct Glazing {
  double mirrored, passed;
};
Glazing glazing(const PaneParameters& pane, double cosine) {
  const double n = double(pane.index);
  const double inside = std::sqrt(std::max(0.0, 1 - (1 - cosine * cosine) / (n * n)));
  const double amplitudes[2] = {(cosine - n * inside) / (cosine + n * inside),
                                (n * cosine - inside) / (n * cosine + inside)};
  // Along the surface, all light is mirrored, or none at an index of 1.
  if (!(cosine > 0)) return n > 1 ? Glazing{1, 0} : Glazing{0, pane.faces == 1 ? 1.0 : 0.0};
  const double kept =
      pane.faces == 1 ? 1 : std::pow(double(pane.inner), 1 / std::max(inside, 1e-3));
  Glazing out{0, 0};
  for (const double amplitude : amplitudes) {
    const double r = amplitude * amplitude, through = (1 - r) * kept;
    if (pane.faces == 1) {
      out.mirrored += r / 2, out.passed += (1 - r) / 2;
    } else if (r < 1) {
      const double echoes = 1 / (1 - r * r * kept * kept);
      out.passed += (1 - r) * through * echoes / 2;
      out.mirrored += (r + r * through * through * echoes) / 2;
    } else {
      out.mirrored += 0.5;
    }
  }
  return out;
}

PaneShares shares_of(const Surface& surface, const Arrival& arrival) {
  const double cosine = std::fabs(double(dot(normalize(arrival.normal), arrival.direction)));
  return shares_of(pane_at(surface, arrival.at), std::min(cosine, 1.0));
}

bool is_share(float x) { return x >= 0 && x <= 1; }

class Pane final : public Kind {
 public:
  explicit Pane(Reads reads) : Kind(reads) {}
  std::string_view name() const override { return "pane"; }
  const char* flaw(std::span<const float> parameters) const override {
    constexpr float kMostIndex = 10;  // no glass is near
    if (parameters.size() != 6) return "other parameters than the six of a pane";
    const PaneParameters pane = pane_of(parameters);
    if (!is_share(pane.coverage) || !is_share(pane.transmission) || !is_share(pane.inner) ||
        !is_share(pane.tint))
      return "a share of a pane that is not 0 to 1";
    if (!(pane.index >= 1 && pane.index <= kMostIndex))
      return "an index of refraction that is not 1 to 10";
    return pane.faces == 1 || pane.faces == 2 ? nullptr
                                              : "a pane that has neither one face nor two";
  }
  bool is_opaque(const Surface&) const override { return true; }
  bool stops(const Surface&, const SurfacePoint&) const override { return true; }
  Vec3f tint(const Surface& surface, const SurfacePoint& at) const override {
    if (!surface.map) return {1, 1, 1};
    const auto texel = texel_at(*surface.map, at);
    if (!texel || !(texel->weight > 0)) return {1, 1, 1};
    return relative({texel->colour * (1 / texel->weight), 1}, surface.map->gain);
  }
  void fetch(const Surface& surface, const SurfacePoint& at) const override {
    if (surface.map) fetch_texel(*surface.map, at);
  }
  Vec3f max_tint(const Surface& surface) const override {
    return surface.map ? most_relative(*surface.map) : Vec3f{1, 1, 1};
  }
  bool has_specular(const Surface& surface) const override {
    const PaneParameters pane = pane_of(surface.parameters);
    return pane.coverage * pane.transmission > 0 && pane.index > 1;
  }
  bool transmits(const Surface& surface) const override {
    const PaneParameters pane = pane_of(surface.parameters);
    return (surface.map && surface.map->texture->least_weight() < 1) || pane.coverage < 1 ||
           (pane.transmission > 0 && pane.tint * (pane.faces == 1 ? 1 : pane.inner) > 0);
  }
  float diffuse_share(const Surface& surface, const SurfacePoint& at) const override {
    return diffuse_share_of(pane_at(surface, at));
  }
  bool onward(const Surface& surface, const Arrival& arrival, float u, float,
              Onward& out) const override {
    const PaneShares own = shares_of(surface, arrival);
    const float both = own.straight + own.mirrored;
    if (!(both > 0)) return false;
    const float weight = both / (1 - own.diffuse);
    out.factor = Vec3f{1, 1, 1} * weight;
    if (!(own.mirrored > 0) || u * both < own.straight) {
      out.lobe = Lobe::straight, out.direction = arrival.direction;
    } else {
      out.lobe = Lobe::specular, out.painted = false;
      out.normal = facing(arrival.normal, arrival.direction);
      out.direction = mirrored(arrival.direction, out.normal);
    }
    return true;
  }
  float transmittance(const Surface& surface, const Arrival& arrival) const override {
    return shares_of(surface, arrival).straight;
  }
  bool scatter(const Surface& surface, const Arrival& arrival, const BounceRandom& random,
               Departure& out) const override {
    const PaneShares own = shares_of(surface, arrival);
    const float u = random(kMore);
    if (u < own.straight) {
      out.lobe = Lobe::straight, out.direction = arrival.direction;
    } else if (u < own.straight + own.mirrored) {
      out.lobe = Lobe::specular;
      out.normal = facing(arrival.normal, arrival.direction);
      out.direction = mirrored(arrival.direction, out.normal);
    } else {
      return u < own.straight + own.mirrored + own.diffuse &&
             scatter_diffusely(surface.diffuse_at(arrival.at), arrival, random, out);
    }
    out.throughput = {1, 1, 1};
    return true;
  }
  Vec3d max_throughput(const Surface&) const override { return {1, 1, 1}; }
};

}  // namespace

std::vector<float> parameters_of(const PaneParameters& pane) {
  return {pane.coverage, pane.transmission, pane.index, pane.faces, pane.inner, pane.tint};
}

PaneShares shares_of(const PaneParameters& pane, double cosine) {
  const float gaps = 1 - pane.coverage, glass = pane.coverage * pane.transmission;
  const Glazing own = glass > 0 ? glazing(pane, cosine) : Glazing{0, 0};
  return {gaps + glass * float(own.passed) * pane.tint, glass * float(own.mirrored),
          diffuse_share_of(pane)};
}

const Kind& pane() {
  static const Pane kind(Reads::nothing);
  return kind;
}

const Kind& textured_pane() {
  static const Pane kind(Reads::texture);
  return kind;
}

}  // namespace deltalux::surfaces
