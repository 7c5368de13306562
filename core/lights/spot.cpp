// SPDX-License-Identifier: Apache-2.0
// Spots: all light within a cone, with the falloff of KHR_lights_punctual at its rim.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "base/cone.h"
#include "lights/placed.h"

namespace deltalux::lights {
namespace {

/// 1 - cosine of the half angles; in single precision, the cosine of a narrow cone is 1.
struct Versines {
  float inner, outer;
  explicit Versines(const Punctual& light)
      : inner(light.parameters[0]), outer(light.parameters[1]) {}
};

class Spot final : public Placed {
 public:
  std::string_view name() const override { return "spot"; }
  const char* flaw(std::span<const float> p) const override {
    if (p.size() == 2 && p[0] >= 0 && p[0] <= p[1] && p[1] > 0 && p[1] <= 2) return nullptr;
    return "other parameters than versines of the inner and the outer half angle";
  }
  float cone(const Punctual& light) const override { return Versines(light).outer; }
  double extent(const Punctual& light) const override {
    const double inner = Versines(light).inner, outer = Versines(light).outer;
    return 2 * std::numbers::pi * (inner + (outer - inner) / 3);
  }

 private:
  double falloff(const Punctual& light, Vec3f d) const override {
    // Computed from the chord between unit vectors: cosines near 1 lack the precision for narrow
    // cones.
    const Vec3d chord = Vec3d(light.direction) - normalize(Vec3d(d));
    const double versine = 0.5 * dot(chord, chord);
    const double inner = Versines(light).inner, outer = Versines(light).outer;
    if (versine <= inner) return 1;
    if (!(versine < outer)) return 0;
    const double x = (outer - versine) / (outer - inner);
    return x * x;
  }
  Vec3f draw(const Punctual& light, float u, float v) const override {
    const auto [inner, outer] = Versines(light);
    const float ring = (outer - inner) / 3;
    const float x = u * (inner + ring);
    float versine = x;
    if (x >= inner && ring > 0)
      versine = std::max(0.0f, outer - (outer - inner) * std::cbrt((inner + ring - x) / ring));
    const float sine = std::sqrt(versine * (2.0f - versine));
    return on_cone(light.direction, 1.0f - versine, sine, v);
  }
};

}  // namespace

const Kind& spot() {
  static const Spot kind;
  return kind;
}

}  // namespace deltalux::lights
