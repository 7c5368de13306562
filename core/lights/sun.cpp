// SPDX-License-Identifier: Apache-2.0
// Suns: parallel light from outside, through a rectangle in front of the whole scene.
#include <algorithm>
#include <limits>

#include "lights/kind.h"

namespace deltalux::lights {
namespace {

class Sun final : public Kind {
 public:
  std::string_view name() const override { return "sun"; }
  const char* flaw(std::span<const float> parameters) const override {
    return parameters.empty() ? nullptr : "parameters, which a sun has none of";
  }
  bool is_parallel() const override { return true; }
  float cone(const Punctual&) const override { return std::numeric_limits<float>::infinity(); }

  void place(Punctual& light, const Pose&, const Box& world) const override {
    tangent_frame(light.direction, light.frame_u, light.frame_v);
    Vec3f low{1e30f, 1e30f, 1e30f}, high = -low;
    for (int i = 0; i < 8; ++i) {
      const Vec3f p{i & 1 ? world.high.x : world.low.x, i & 2 ? world.high.y : world.low.y,
                    i & 4 ? world.high.z : world.low.z};
      const Vec3f q{dot(p, light.frame_u), dot(p, light.frame_v), dot(p, light.direction)};
      low = min(low, q), high = max(high, q);
    }
    const Vec3f size = high - low;
    light.corner = light.frame_u * low.x + light.frame_v * low.y + light.direction * low.z;
    light.frame_u = light.frame_u * size.x;
    light.frame_v = light.frame_v * size.y;
    light.area = double(size.x) * double(size.y);
  }

  double extent(const Punctual& light) const override { return light.area; }
  double max_extent(const Punctual&, const Box& world) const override {
    // No side of the rectangle is longer than the box's diagonal.
    return double(world.diagonal()) * double(world.diagonal());
  }
  Start start(const Punctual& light, const std::array<float, 4>& random) const override {
    return {light.corner + light.frame_u * random[0] + light.frame_v * random[1], light.direction};
  }

  double irradiance(const Punctual& light, Vec3f, Vec3f normal, float) const override {
    return std::max(0.0f, -dot(normal, light.direction));
  }
  ShadowRay shadow_ray(const Punctual& light, Vec3f) const override {
    return {-light.direction, std::numeric_limits<float>::infinity()};
  }
};

}  // namespace

const Kind& sun() {
  static const Sun kind;
  return kind;
}

}  // namespace deltalux::lights
