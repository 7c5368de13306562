// SPDX-License-Identifier: Apache-2.0
// What all shapes of lights have in common; lights without a surface, which one ray samples.
#include "direct/light_shape.h"

#include <algorithm>
#include <bit>

#include "base/assertion.h"
#include "direct/area_shape.h"
#include "direct/lane_sum.h"

namespace deltalux::direct {
namespace {

uint64_t pair_bits(float a, float b) {
  return uint64_t(std::bit_cast<uint32_t>(a)) << 32 | std::bit_cast<uint32_t>(b);
}

class PunctualShape final : public LightShape {
 public:
  PunctualShape(const trace::Light& light, uint32_t number, uint64_t seed)
      : LightShape(light, number, seed), light_(light.punctual) {}

  Glance glance(const Receiver& receiver, float, float) const override {
    const double irradiance = full(receiver);
    if (!(irradiance > 0)) return {};
    const Vec3f from = origin(receiver);
    const auto [d, to] = light_.kind->shadow_ray(light_, from);
    return {from, d, to, irradiance};
  }
  void cast(const Receiver& receiver, Detail, Strata& out) const override {
    out.fan.origin = origin(receiver);
    out.countable = {};
    out.fan.count = 1;
    out.rows = 1;
    out.too_coarse = false;
    out.weight[0] = full(receiver) > 0;
    out.countable[0] = out.weight[0] > 0;
    const auto [d, to] = light_.kind->shadow_ray(light_, out.fan.origin);
    out.fan.to = to;
    out.fan.x[0] = d.x, out.fan.y[0] = d.y, out.fan.z[0] = d.z;
  }

 private:
  double full(const Receiver& receiver) const override {
    return light_.kind->irradiance(light_, receiver.point, receiver.normal, receiver.slack());
  }
  bool may_reach(const Box& points) const override {
    return light_.kind->may_reach(light_, points);
  }

  lights::Punctual light_;
};

}  // namespace

uint64_t place_key(Vec3f p, Vec3f n) {
  return combine(combine(pair_bits(p.x, p.y), pair_bits(p.z, n.x)), pair_bits(n.y, n.z));
}

double Strata::share(const trace::RayBits& seen) const {
  if (seen == countable) return 1;
  alignas(64) std::array<float, trace::RayFan::kMaxRays> lit{};
  const auto sum = [&](const trace::RayBits& rays) {
    for (size_t i = 0; i < fan.count; ++i)
      lit[i] = (rays[i / 64] >> (i % 64)) & 1 ? weight[i] : 0.0f;
    return double(lane_sum(lit.data(), fan.count));
  };
  const double all = sum(countable);
  return all > 0 ? sum(seen) / all : 0.0;
}

LightShape::LightShape(const trace::Light& light, uint32_t number, uint64_t seed)
    : on_(light.on), key_(combine(mix64(seed), number)) {
  const Vec3f power = light.strength;
  brightest_ = std::max({power.x, power.y, power.z});
}

void LightShape::divide(const Receiver&, const Cells&, Strata&) const { DELTALUX_ASSERT(false); }

std::unique_ptr<const LightShape> shape_of(const trace::Light& light, uint32_t number,
                                           uint64_t seed, double reference) {
  if (light.world.empty()) return std::make_unique<PunctualShape>(light, number, seed);
  return std::make_unique<AreaShape>(light, number, seed, reference);
}

}  // namespace deltalux::direct
