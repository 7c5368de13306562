// SPDX-License-Identifier: Apache-2.0
// Chooses each light's share of the paths from pilot paths, and where the paths of suns start.
#include "plan/allotment.h"

#include <algorithm>
#include <cmath>

#include "plan/light_guiding.h"
#include "plan/light_pilot.h"
#include "plan/pilot_points.h"
#include "plan/sun_guiding.h"
#include "samples/placement.h"

namespace deltalux::plan {
namespace {

constexpr uint32_t kPoints = 4096;
constexpr uint32_t kPathsPerLight = 2048;  // fewer per light if there are many lights
constexpr uint32_t kPathsInAll = 65536;
// Relative to the irradiance of other points: darker points count as having this irradiance.
constexpr double kFloor = 0.1;
constexpr double kDim = 0.25;       // share of the lit places that are darker
constexpr double kMinShare = 0.02;  // relative to the share by power alone

bool moves(const scene::Scene& scene, const trace::Light& light) {
  return light.object != scene::kNone && scene.objects[light.object].movable;
}

/// Weights that make errors relative: one over the irradiance of each point, or of `others` where
/// that is larger.
std::vector<double> weights(const std::vector<double>& all, double others) {
  std::vector<double> out;
  for (double e : all) out.push_back(1 / (e + kFloor * others));
  return out;
}

/// A low quantile of the irradiance of lit places: outside, in the sun, it may be a thousand times
/// as bright.
double dim_irradiance(const std::vector<double>& all) {
  std::vector<double> lit;
  for (double e : all)
    if (e > 0) lit.push_back(e);
  const auto at = lit.begin() + long(kDim * double(lit.size()));
  std::nth_element(lit.begin(), at, lit.end());
  return *at;
}

/// The shares that `use` of each light (negative: not measured) and its power suggest.
std::vector<double> allotments_of(std::span<const double> power, std::span<const double> use) {
  std::vector<double> wanted(power.size(), -1);
  double measured = 0, measured_power = 0, total_power = 0;
  for (size_t l = 0; l < power.size(); ++l) {
    total_power += power[l];
    if (use[l] < 0) continue;
    wanted[l] = std::sqrt(power[l] * use[l]);
    measured += wanted[l];
    measured_power += power[l];
  }
  if (!(measured > 0)) return {power.begin(), power.end()};
  double total = 0;
  for (size_t l = 0; l < power.size(); ++l) {
    if (wanted[l] < 0) wanted[l] = power[l] * measured / measured_power;
    total += wanted[l];
  }
  for (size_t l = 0; l < power.size(); ++l)
    wanted[l] = std::max(wanted[l] / total, kMinShare * power[l] / total_power);
  return wanted;
}

}  // namespace

std::vector<double> shares_by_use(const scene::Scene& scene, const trace::RayCaster& caster,
                                  const samples::SampleSet& samples, std::span<trace::Light> lights,
                                  const Workers& workers, Progress& progress) {
  const std::vector<double> power = trace::shares_by_power(lights);
  const auto may_be_guided = [&](const trace::Light& light) {
    return light.is_parallel() && !moves(scene, light);
  };
  const float metre = samples::scene_metre(scene, caster);
  const auto may_aim = [&](const trace::Light& light) {
    return may_be_aimed(light, metre) && !moves(scene, light);
  };
  if (lights.size() < 2 && std::none_of(lights.begin(), lights.end(), may_be_guided) &&
      std::none_of(lights.begin(), lights.end(), may_aim))
    return power;
  const LightPilot pilot(scene, caster, pilot_points(scene, caster, samples, metre, kPoints),
                         workers, progress);
  const size_t n = pilot.points();
  if (n == 0) return power;

  progress.begin("pilot", lights.size());
  const auto count =
      std::clamp<uint32_t>(kPathsInAll / uint32_t(lights.size()), 64, kPathsPerLight);
  const auto few = [&](size_t l) {
    trace::Light light = lights[l];
    light.path_count = count;
    light.finer = 0;  // pilots have a scale for each light
    light.first_path = uint64_t(l) * kPathsPerLight;
    return light;
  };
  const auto is_wide = [&](size_t l) { return lights[l].is_parallel() || may_aim(lights[l]); };
  std::vector<LightPilot::Given> given(lights.size());
  workers.for_blocks(lights.size(), 1, [&](size_t l, size_t) {
    progress.check();
    lights[l].map = nullptr, lights[l].aims = nullptr;
    if (!moves(scene, lights[l])) given[l] = pilot.given(few(l), is_wide(l));
    progress.advance(1);
  });
  std::vector<double> all(n);
  for (const LightPilot::Given& one : given)
    for (size_t i = 0; i < one.all.size(); ++i) all[i] += one.all[i];
  double mean = 0;
  for (double e : all) mean += e / double(n);
  if (!(mean > 0)) return power;
  const std::vector<double> inside = weights(all, dim_irradiance(all));
  for (size_t l = 0; l < lights.size(); ++l) {
    if (may_be_guided(lights[l]))
      lights[l].map = guide_sun(pilot, few(l), inside, workers, progress);
    else if (may_aim(lights[l]))
      lights[l].aims = aim_light(pilot, few(l), inside, workers, progress);
    if (lights[l].map || lights[l].aims) given[l] = pilot.given(few(l), is_wide(l));
  }

  const std::vector<double> weight = weights(all, mean);
  std::vector<double> use(lights.size(), -1);
  for (size_t l = 0; l < lights.size(); ++l) {
    if (given[l].all.empty()) continue;
    use[l] = 0;
    for (size_t i = 0; i < n; ++i) use[l] += given[l].indirect[i] * weight[i] * weight[i];
  }
  return allotments_of(power, use);
}

}  // namespace deltalux::plan
