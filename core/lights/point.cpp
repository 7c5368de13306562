// SPDX-License-Identifier: Apache-2.0
// Point lights: the same intensity in all directions.
#include <cmath>
#include <numbers>

#include "base/cone.h"
#include "lights/placed.h"

namespace deltalux::lights {
namespace {

class Point final : public Placed {
 public:
  std::string_view name() const override { return "point"; }
  const char* flaw(std::span<const float> parameters) const override {
    return parameters.empty() ? nullptr : "parameters, which a point light has none of";
  }
  float cone(const Punctual&) const override { return 2; }
  double extent(const Punctual&) const override { return 4 * std::numbers::pi; }

 private:
  double falloff(const Punctual&, Vec3f) const override { return 1; }
  Vec3f draw(const Punctual&, float u, float v) const override {
    const float cosine = 1.0f - 2.0f * u;
    return on_cone({0, 0, 1}, cosine, sine_of(cosine), v);
  }
};

}  // namespace

const Kind& point() {
  static const Point kind;
  return kind;
}

}  // namespace deltalux::lights
