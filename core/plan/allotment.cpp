// SPDX-License-Identifier: Apache-2.0
// The pilot behind the shares of paths: a few paths of every light, deposited into a few discs.
#include "plan/allotment.h"

#include <algorithm>
#include <cmath>

#include "base/direction.h"
#include "base/random.h"
#include "estimate/disc_index.h"
#include "samples/disc_area.h"
#include "samples/placement.h"
#include "trace/walk.h"

namespace deltalux::plan {
namespace {

constexpr uint64_t kSeed = 20070129;  // its own; the shares hold for every seed of a session
constexpr uint32_t kPoints = 4096;
constexpr float kRadius = 0.15f;           // scene metres
constexpr uint32_t kPathsPerLight = 2048;  // fewer where there are many lights
constexpr uint32_t kPathsInAll = 65536;
constexpr double kFloor = 0.1;        // of the mean irradiance: darker points count as that
constexpr double kLeastShare = 0.02;  // of what power alone would give
constexpr uint32_t kBounces = 16;

double photopic(const int64_t* e) {
  return 0.2126 * double(e[0]) + 0.7152 * double(e[1]) + 0.0722 * double(e[2]);
}

bool moves(const scene::Scene& scene, const trace::Light& light) {
  return light.object != scene::kNone && scene.objects[light.object].movable;
}

/// Points spread by area over the front sides of the static surfaces.
samples::SampleSet surface_points(const scene::Scene& scene, const trace::RayCaster& caster) {
  std::vector<double> cumulative;
  std::vector<std::array<Vec3f, 3>> corners;
  double area = 0;
  for (const scene::Object& object : scene.objects) {
    if (object.movable) continue;
    const std::vector<Vec3f> world = object.world_vertices();
    for (const auto& t : object.triangles) {
      const std::array<Vec3f, 3> p{world[t[0]], world[t[1]], world[t[2]]};
      const double own = 0.5 * length(cross(Vec3d(p[1] - p[0]), Vec3d(p[2] - p[0])));
      if (!(own > 0)) continue;
      cumulative.push_back(area += own);
      corners.push_back(p);
    }
  }
  samples::SampleSet set;
  const float radius = kRadius * samples::scene_metre(scene, caster);
  const PathRandom random(kSeed, 0);
  for (uint32_t i = 0; i < kPoints && !corners.empty(); ++i) {
    const double place = (i + double(random(i, 0))) / kPoints * area;
    const size_t k = std::min<size_t>(
        size_t(std::upper_bound(cumulative.begin(), cumulative.end(), place) - cumulative.begin()),
        corners.size() - 1);
    float u = random(i, 1), v = random(i, 2);
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const auto& p = corners[k];
    set.point.push_back(p[0] + (p[1] - p[0]) * u + (p[2] - p[0]) * v);
    set.normal.push_back(Vec3f(normalize(cross(Vec3d(p[1] - p[0]), Vec3d(p[2] - p[0])))));
    set.radius.push_back(radius);
    set.attached.push_back(scene::kNone);
  }
  return set;
}

/// Flights of the pilot's paths of one light, as arrays.
struct Flights {
  std::vector<float> column[7];
  std::vector<uint32_t> power;

  void add(const trace::Flight& flight, float length) {
    const Vec3f o = flight.origin, w = decode_direction(flight.direction);
    const float values[7] = {o.x, o.y, o.z, w.x, w.y, w.z, length};
    for (int k = 0; k < 7; ++k) column[k].push_back(values[k]);
    power.insert(power.end(), flight.power, flight.power + 3);
  }
  segments::SegmentSpan span() const {
    const float* c[7];
    for (int k = 0; k < 7; ++k) c[k] = column[k].data();
    return {column[0].size(), c[0],   c[1], c[2], c[3], c[4], c[5], c[6], c[6],
            power.data(),     nullptr};
  }
};

Flights fly(const trace::Walk& walk, const trace::Light& light,
            const std::array<uint32_t, 3>& quanta) {
  Flights flights;
  for (uint64_t i = 0; i < light.path_count; ++i) {
    trace::Flight flight = walk.birth(light, i, quanta);
    for (uint32_t bounce = 0;; ++bounce) {
      const trace::Landing landing = walk.fly(flight, bounce);
      flights.add(flight, landing.length);
      if (!landing.survives) break;
      flight = landing.next;
    }
  }
  return flights;
}

}  // namespace

std::vector<double> shares_by_use(const scene::Scene& scene, std::span<const Vec3f> reflectance,
                                  const trace::RayCaster& caster,
                                  std::span<const trace::Light> lights, const Workers& workers,
                                  Progress& progress) {
  const std::vector<double> power = trace::shares_by_power(lights);
  if (lights.size() < 2) return power;
  const samples::SampleSet points = surface_points(scene, caster);
  if (points.size() == 0) return power;
  scene::Scene loaded = scene;
  for (size_t m = 0; m < loaded.materials.size(); ++m)
    loaded.materials[m].reflectance = reflectance[m];
  std::vector<uint32_t> ids(points.size());
  for (uint32_t i = 0; i < ids.size(); ++i) ids[i] = i;
  const estimate::DiscIndex index(
      samples::make_discs(points, std::move(ids), samples::DiscArea::whole,
                          {scene, caster, 0, scene.world()}, workers, progress),
      segments::SegmentEnd::first, workers, &progress);

  progress.begin("pilot", lights.size());
  const uint32_t pilot =
      std::clamp<uint32_t>(kPathsInAll / uint32_t(lights.size()), 64, kPathsPerLight);
  const size_t n = points.size();
  // Irradiance of each light at each point, up to a common factor.
  std::vector<std::vector<double>> given(lights.size());
  workers.for_blocks(lights.size(), 1, [&](size_t l, size_t) {
    progress.check();
    if (moves(scene, lights[l])) return;
    trace::Light light = lights[l];
    light.path_count = pilot;
    light.first_path = uint64_t(l) * kPathsPerLight;
    const trace::EnergyScale scale = trace::choose_scale({&light, 1}, kBounces);
    const trace::Walk walk(loaded, caster, {kSeed, 1, kBounces, false, 0, true});
    const Flights flights = fly(walk, light, trace::birth_quanta(light, scale, 1.0));
    std::vector<int64_t> sums(3 * n);
    index.accumulate(flights.span(), +1, {sums.data(), n, false});
    given[l].resize(n);
    for (size_t i = 0; i < n; ++i) given[l][i] = photopic(sums.data() + 3 * i) * scale.quantum;
    progress.advance(1);
  });
  std::vector<double> all(n);
  double mean = 0;
  for (const auto& one : given)
    for (size_t i = 0; i < one.size(); ++i) all[i] += one[i];
  for (double e : all) mean += e / double(n);
  if (!(mean > 0)) return power;

  std::vector<double> wanted(lights.size(), -1);
  double measured = 0, measured_power = 0, total_power = 0;
  for (size_t l = 0; l < lights.size(); ++l) {
    total_power += power[l];
    if (given[l].empty()) continue;
    double use = 0;
    for (size_t i = 0; i < n; ++i) {
      const double e = all[i] + kFloor * mean;
      use += given[l][i] / (e * e);
    }
    wanted[l] = std::sqrt(power[l] * use);
    measured += wanted[l];
    measured_power += power[l];
  }
  if (!(measured > 0)) return power;
  double total = 0;
  for (size_t l = 0; l < lights.size(); ++l) {
    if (wanted[l] < 0) wanted[l] = power[l] * measured / measured_power;
    total += wanted[l];
  }
  for (size_t l = 0; l < lights.size(); ++l)
    wanted[l] = std::max(wanted[l] / total, kLeastShare * power[l] / total_power);
  return wanted;
}

}  // namespace deltalux::plan
