// SPDX-License-Identifier: Apache-2.0
// Chooses a light, and a point on it, by what they would give without shadows.
#include "gather/hits/one_light.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace deltalux::gather {
namespace {

/// Replaces LightShape::glance close to a light, where points drawn uniformly differ much in
/// contribution: returns the exact unshadowed irradiance, and one of many shadow rays, chosen by
/// its share of it.
direct::LightShape::Glance close_glance(const direct::LightShape& shape,
                                        const direct::Receiver& receiver, float place) {
  direct::Strata strata;
  shape.cast(receiver, direct::Detail::coarse, strata);
  double all = 0;
  const auto weight = [&](size_t i) {
    return strata.countable[i / 64] >> (i % 64) & 1 ? double(strata.weight[i]) : 0.0;
  };
  for (size_t i = 0; i < strata.fan.count; ++i) all += weight(i);
  if (!(all > 0)) return {};
  double left = double(place) * all;
  size_t chosen = 0;
  for (size_t i = 0; i < strata.fan.count; ++i) {
    if (!(weight(i) > 0)) continue;
    chosen = i;
    left -= weight(i);
    if (left < 0) break;
  }
  return {strata.fan.origin,
          {strata.fan.x[chosen], strata.fan.y[chosen], strata.fan.z[chosen]},
          strata.fan.to,
          shape.open(receiver)};
}

}  // namespace

OneLight::OneLight(std::span<const trace::Light> lights,
                   const std::function<bool(uint32_t)>& takes_part, uint32_t groups, uint64_t seed)
    : lights_(lights), shapes_(lights.size()), groups_(groups) {
  std::map<uint32_t, std::vector<uint32_t>> placed;  // by group
  for (uint32_t i = 0; i < lights.size(); ++i) {
    if (!lights[i].on || !takes_part(i)) continue;
    shapes_[i] = direct::shape_of(lights[i], i, seed);
    if (!lights[i].is_parallel()) placed[lights[i].group].push_back(i);
  }
  for (uint32_t i = 0; i < lights.size(); ++i)
    if (shapes_[i] && (lights[i].is_parallel() || placed[lights[i].group].size() <= kMany))
      choices_.push_back({lights[i].group, i, {}});
  for (auto& [group, members] : placed)
    if (members.size() > kMany)
      choices_.push_back({group, scene::kNone, LightTree(lights, shapes_, std::move(members))});
}

double OneLight::weigh(const trace::RayCaster& caster, const Choice& choice,
                       const direct::Receiver& receiver) const {
  if (!choice.tree.empty()) return choice.tree.about(receiver);
  const direct::LightShape& shape = *shapes_[choice.light];
  const double weight = shape.about(receiver) * shape.brightest();
  if (!(weight > 0) || !lights_[choice.light].is_parallel()) return weight;
  const direct::LightShape::Glance ray = shape.glance(receiver, 0, 0);
  return caster.occluded_static(ray.origin, ray.direction, ray.to) ? 0 : weight;
}

void OneLight::ask(const trace::RayCaster& caster, const direct::Receiver& receiver,
                   const Draw& draw, Vertex& out) const {
  thread_local std::vector<double> weight, of_group;
  weight.assign(choices_.size(), 0), of_group.assign(groups_, 0);
  double all = 0;
  for (size_t k = 0; k < choices_.size(); ++k) {
    weight[k] = weigh(caster, choices_[k], receiver);
    of_group[choices_[k].group] += weight[k], all += weight[k];
  }
  out.light = scene::kNone, out.direct = {};
  if (!(all > 0) || !std::isfinite(all)) return;
  const double groups =
      double(std::count_if(of_group.begin(), of_group.end(), [](double w) { return w > 0; }));
  const auto chance = [&](size_t k) {
    return 0.5 * weight[k] / all + 0.5 * weight[k] / (groups * of_group[choices_[k].group]);
  };
  double left = double(draw[0]);
  size_t chosen = choices_.size();
  for (size_t k = 0; k < choices_.size() && left >= 0; ++k) {
    if (!(weight[k] > 0)) continue;
    chosen = k;
    left -= chance(k);
  }
  // Reuse the random number of the choice: rescaled within its interval, it is uniform again.
  double u = std::clamp((left + chance(chosen)) / chance(chosen), 0.0, 1 - 0x1p-24), within = 1;
  const Choice& choice = choices_[chosen];
  out.light = choice.tree.empty() ? choice.light : choice.tree.draw(receiver, u, within);
  if (out.light != scene::kNone)
    shine(caster, receiver, out.light, chance(chosen) * within, float(u), draw[1], out);
}

void OneLight::shine(const trace::RayCaster& caster, const direct::Receiver& receiver,
                     uint32_t light, double chance, float u, float v, Vertex& out) const {
  const direct::LightShape& shape = *shapes_[light];
  const direct::LightShape::Glance ray =
      shape.is_small(receiver) ? shape.glance(receiver, u, v) : close_glance(shape, receiver, u);
  if (!(ray.irradiance > 0) || caster.occluded(ray.origin, ray.direction, ray.to)) return;
  const Vec3f power = lights_[light].strength;
  const double passed = double(caster.transmittance(ray.origin, ray.direction, ray.to));
  const double factor = passed * ray.irradiance / chance;
  for (int c = 0; c < 3; ++c) out.direct[size_t(c)] = float(double(power[c]) * factor);
}

}  // namespace deltalux::gather
