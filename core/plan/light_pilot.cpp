// SPDX-License-Identifier: Apache-2.0
// Converts pilot paths to segments, and deposits these on discs.
#include "plan/light_pilot.h"

#include <algorithm>
#include <numeric>

#include "base/direction.h"
#include "base/random.h"
#include "samples/disc_area.h"
#include "samples/placement.h"
#include "segments/segment_columns.h"

namespace deltalux::plan {
namespace {

// Independent of the session's seed, so that the result holds for every seed.
constexpr uint64_t kSeed = 20070129;
constexpr uint32_t kPoints = 4096;
constexpr float kRadius = 0.15f;  // scene metres

double photopic(const int64_t* e) {
  return 0.2126 * double(e[0]) + 0.7152 * double(e[1]) + 0.0722 * double(e[2]);
}

scene::Scene painted(scene::Scene scene, std::span<const Vec3f> reflectance) {
  for (size_t m = 0; m < scene.materials.size(); ++m)
    scene.materials[m].reflectance = reflectance[m];
  return scene;
}

estimate::DiscIndex disc_index(const scene::Scene& scene, const trace::RayCaster& caster,
                               const Workers& workers, Progress& progress) {
  Progress part;  // far below a second
  const samples::SampleSet points = surface_points(scene, caster, kPoints);
  std::vector<uint32_t> ids(points.size());
  std::iota(ids.begin(), ids.end(), 0u);
  return {samples::make_discs(points, std::move(ids), samples::DiscArea::whole,
                              {scene, caster, 0, scene.world()}, workers, part),
          segments::SegmentEnd::first, workers, &progress};
}

}  // namespace

samples::SampleSet surface_points(const scene::Scene& scene, const trace::RayCaster& caster,
                                  uint32_t count) {
  std::vector<double> cumulative;
  std::vector<std::array<Vec3f, 3>> corners;
  cumulative.reserve(scene.static_primitives());
  corners.reserve(scene.static_primitives());
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
  for (uint32_t i = 0; i < count && !corners.empty(); ++i) {
    const double place = (i + double(random(i, 0))) / count * area;
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

/// The ends of segments as a structure of arrays. Only the ends, since discs that extend beyond a
/// room would count segments that pass by outside.
struct LightPilot::Flights {
  float reach;  ///< longer segments are cut to this length before their end
  segments::SegmentColumns columns;

  explicit Flights(const LightPilot& pilot) : reach(2 * pilot.index_.discs().radius.front()) {}
  void add(const trace::Flight& flight, float length, uint16_t path) {
    const Vec3f w = decode_direction(flight.direction);
    const float left = std::min(length, reach);
    const Vec3f o = flight.origin + w * (length - left);
    columns.add(o, w, left, left, flight.power);
    columns.slab.push_back(path);
  }
};

LightPilot::LightPilot(const scene::Scene& scene, std::span<const Vec3f> reflectance,
                       const trace::RayCaster& caster, const Workers& workers, Progress& progress)
    : scene_(painted(scene, reflectance)),
      caster_(caster),
      index_(disc_index(scene, caster, workers, progress)) {}

trace::Walk LightPilot::walk(uint32_t batches) const {
  return {scene_, caster_, {kSeed, batches, kBounces, false, 0, true}};
}

LightPilot::Given LightPilot::given(const trace::Light& light) const {
  const trace::EnergyScale scale = trace::choose_scale({&light, 1}, kBounces);
  const auto quanta = trace::birth_quanta(light, scale, 1.0);
  const trace::Walk paths = walk(1);
  const double most = light.max_weight();
  Flights all(*this), weighed(*this);
  for (uint64_t i = 0; i < light.path_count; ++i) {
    const trace::Emission start = trace::emit(light, kSeed, i, 1);
    const auto add = [&](trace::Flight flight, const trace::Interaction& end, uint32_t bounce) {
      if (end.primitive == scene::kNone) return;
      all.add(flight, end.length, 0);
      if (bounce == 0) return;
      // The scale admits no more power: divide by the largest weight, and multiply after
      // summing.
      for (uint32_t& power : flight.power)
        power = uint32_t(double(power) * (double(start.weight) / most));
      weighed.add(flight, end.length, 0);
    };
    paths.follow(paths.birth(light, i, start, quanta), add);
  }
  const auto read = [&](const Flights& flights, double factor) {
    const size_t n = points();
    std::vector<int64_t> sums(3 * n);
    index_.accumulate(flights.columns.span(), +1, {sums.data(), n, false});
    std::vector<double> out(n);
    for (size_t i = 0; i < n; ++i) out[i] = photopic(sums.data() + 3 * i) * factor;
    return out;
  };
  return {read(all, scale.quantum), read(weighed, scale.quantum * most)};
}

void LightPilot::brought(const trace::Light& light, std::span<const trace::Emission> starts,
                         uint64_t first, std::span<const double> weight, double* out) const {
  const trace::EnergyScale scale = trace::choose_scale({&light, 1}, kBounces);
  const auto quanta = trace::birth_quanta(light, scale, 1.0);
  const trace::Walk paths = walk(1);
  Flights flights(*this);
  for (size_t k = 0; k < starts.size(); ++k) {
    const auto add = [&](const trace::Flight& flight, const trace::Interaction& end,
                         uint32_t bounce) {
      if (bounce > 0 && end.primitive != scene::kNone) flights.add(flight, end.length, uint16_t(k));
    };
    paths.follow(paths.birth(light, first + k, starts[k], quanta), add);
  }
  const size_t n = points();
  std::vector<int64_t> sums(3 * n * starts.size());
  index_.accumulate(flights.columns.span(), +1, {sums.data(), n, false});
  for (size_t k = 0; k < starts.size(); ++k) {
    const int64_t* own = sums.data() + 3 * n * k;
    out[k] = 0;
    for (size_t i = 0; i < n; ++i)  // most points receive nothing from one path
      if (own[3 * i] | own[3 * i + 1] | own[3 * i + 2]) out[k] += photopic(own + 3 * i) * weight[i];
    out[k] *= scale.quantum;
  }
}

}  // namespace deltalux::plan
