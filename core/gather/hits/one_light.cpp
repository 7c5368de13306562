// SPDX-License-Identifier: Apache-2.0
// Chooses a light, and a point on it, by what they would give without shadows.
#include "gather/hits/one_light.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

namespace deltalux::gather {
namespace {

/// Replaces LightShape::glance close to a light, where points drawn uniformly differ much in
/// contribution: returns the unshadowed irradiance, exactly or, of lights where that takes long, by
/// the strata, and one of many shadow rays, chosen by its share of it.
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
          shape.has_many_parts() ? shape.by_strata(strata) : shape.open(receiver)};
}

/// Of light that nothing hides; never 0, which says that something does.
float unhidden(double direct) { return std::max(float(direct), std::numeric_limits<float>::min()); }

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

OneLight::Chosen OneLight::choose(const trace::RayCaster& caster, const direct::Receiver& receiver,
                                  const Draw& draw) const {
  thread_local std::vector<double> weight_of_thread, group_of_thread;
  // Every use of a thread's own variable looks it up.
  std::vector<double>&weight = weight_of_thread, &of_group = group_of_thread;
  weight.assign(choices_.size(), 0), of_group.assign(groups_, 0);
  double all = 0;
  for (size_t k = 0; k < choices_.size(); ++k) {
    weight[k] = weigh(caster, choices_[k], receiver);
    of_group[choices_[k].group] += weight[k], all += weight[k];
  }
  if (!(all > 0) || !std::isfinite(all)) return {};
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
  const Choice& choice = choices_[chosen];
  if (choice.tree.empty()) return {choice.light, chance(chosen)};
  // Reuse the random number of the choice: rescaled within its interval, it is uniform again.
  double u = std::clamp((left + chance(chosen)) / chance(chosen), 0.0, 1 - 0x1p-24), within = 1;
  const uint32_t light = choice.tree.draw(receiver, u, within);
  return {light, chance(chosen) * within};
}

direct::LightShape::Glance OneLight::glance(uint32_t light, const direct::Receiver& receiver,
                                            const Draw& draw) const {
  // A number that is independent of the choice: what another light does must not move the point.
  const uint64_t both =
      uint64_t(std::bit_cast<uint32_t>(draw[0])) << 32 | std::bit_cast<uint32_t>(draw[1]);
  const float u = unit_float(mix64(both));
  const direct::LightShape& shape = *shapes_[light];
  return shape.is_small(receiver) ? shape.glance(receiver, u, draw[1])
                                  : close_glance(shape, receiver, u);
}

OneLight::Answer OneLight::ask(const trace::RayCaster& caster, const direct::Receiver& receiver,
                               const Draw& draw, const Chosen& chosen) const {
  if (chosen.light == scene::kNone) return {};
  const direct::LightShape::Glance ray = glance(chosen.light, receiver, draw);
  if (!(ray.irradiance > 0) || caster.occluded(ray.origin, ray.direction, ray.to))
    return {chosen.light, 0};
  const double passed = double(caster.transmittance(ray.origin, ray.direction, ray.to));
  return {chosen.light, passed > 0 ? unhidden(passed * ray.irradiance / chosen.chance) : 0};
}

OneLight::Answer OneLight::ask(const trace::RayCaster& caster, const direct::Receiver& receiver,
                               const Draw& draw) const {
  return ask(caster, receiver, draw, choose(caster, receiver, draw));
}

OneLight::Answer OneLight::ask_again(const trace::RayCaster& caster,
                                     const direct::Receiver& receiver, const Draw& draw,
                                     const Answer& before, Renewal why, bool& casts) const {
  if (why == Renewal::shadow) {  // The same light is chosen with the same probability.
    casts = true;
    const direct::LightShape::Glance ray = glance(before.light, receiver, draw);
    if (!(ray.irradiance > 0) || caster.occluded(ray.origin, ray.direction, ray.to))
      return {before.light, 0};
    if (before.direct > 0) return before;
  }
  const Chosen chosen = choose(caster, receiver, draw);
  if (chosen.light == scene::kNone) return {};
  if (chosen.light != before.light || why != Renewal::chances) {
    casts = true;
    return ask(caster, receiver, draw, chosen);
  }
  if (!(before.direct > 0)) return before;
  return {chosen.light, unhidden(glance(chosen.light, receiver, draw).irradiance / chosen.chance)};
}

}  // namespace deltalux::gather
