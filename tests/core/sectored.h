// SPDX-License-Identifier: Apache-2.0
// A kind of light that no scene has: a table of intensities by sector about its direction, so that
// a lamp that turns about that direction sends other light. For tests.
#pragma once
#include <algorithm>
#include <cmath>
#include <numbers>

#include "lights/placed.h"

namespace deltalux::lights {

/// Shines into the cone of versine kWidth, in each of its sectors with another intensity.
/// Parameters: a direction, local to what carries the light, from which sectors count; and their
/// intensities, relative to the greatest.
class Sectored final : public Placed {
 public:
  static constexpr float kWidth = 0.2f;

  std::string_view name() const override { return "sectored"; }
  const char* flaw(std::span<const float> p) const override {
    return p.size() > 3 ? nullptr : "other parameters than a direction and intensities";
  }
  float cone(const Punctual&) const override { return kWidth; }
  std::shared_ptr<const Tables> prepare(std::span<const float> p) const override {
    auto made = std::make_shared<Sectors>();
    made->intensity.assign(p.begin() + 3, p.end());
    float sum = 0;
    for (float own : made->intensity) made->cumulative.push_back(sum += own);
    for (float& own : made->cumulative) own /= sum;
    made->mean = double(sum) / double(made->intensity.size());
    return made;
  }
  void place(Punctual& light, const Pose& pose, const Box&) const override {
    const Vec3f from =
        pose.direction(Vec3f{light.parameters[0], light.parameters[1], light.parameters[2]});
    light.frame_v = normalize(cross(light.direction, from));
    light.frame_u = cross(light.frame_v, light.direction);
  }
  double extent(const Punctual& light) const override {
    return 2 * std::numbers::pi * double(kWidth) * sectors(light).mean;
  }

 private:
  struct Sectors final : Tables {
    std::vector<float> intensity, cumulative;
    double mean = 0;
  };
  static const Sectors& sectors(const Punctual& light) {
    return static_cast<const Sectors&>(*light.tables);
  }
  double falloff(const Punctual& light, Vec3f d) const override {
    const Vec3f w = normalize(d);
    if (!(dot(w, light.direction) > 1 - kWidth)) return 0;
    const float turn =
        std::atan2(dot(w, light.frame_v), dot(w, light.frame_u)) / (2 * std::numbers::pi_v<float>);
    const std::vector<float>& all = sectors(light).intensity;
    const auto sector = size_t((turn < 0 ? turn + 1 : turn) * float(all.size()));
    return double(all[std::min(sector, all.size() - 1)]);
  }
  Vec3f draw(const Punctual& light, float u, float v) const override {
    const Sectors& own = sectors(light);
    size_t i = 0;
    while (i + 1 < own.cumulative.size() && v >= own.cumulative[i]) ++i;
    const float before = i ? own.cumulative[i - 1] : 0.0f;
    const float within = std::clamp((v - before) / (own.cumulative[i] - before), 0.0f, 0.999999f);
    const float turn =
        2 * std::numbers::pi_v<float> * (float(i) + within) / float(own.intensity.size());
    const float versine = u * kWidth, sine = std::sqrt(versine * (2 - versine));
    return light.frame_u * (std::cos(turn) * sine) + light.frame_v * (std::sin(turn) * sine) +
           light.direction * (1 - versine);
  }
};

inline const Kind& sectored() {
  static const Sectored kind;
  return kind;
}

}  // namespace deltalux::lights
