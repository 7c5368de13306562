// SPDX-License-Identifier: Apache-2.0
// Converts pilot paths to segments, and deposits these on discs.
#include "plan/light_pilot.h"

#include <algorithm>
#include <numbers>
#include <numeric>

#include "base/direction.h"
#include "base/random.h"
#include "samples/disc_area.h"
#include "segments/segment_columns.h"

namespace deltalux::plan {
namespace {

// Independent of the session's seed, so that the result holds for every seed.
constexpr uint64_t kSeed = 20070129;

/// Of three sums.
double photopic(const int64_t* e) {
  return deltalux::photopic({double(e[0]), double(e[1]), double(e[2])});
}

estimate::DiscIndex disc_index(const scene::Scene& scene, const trace::RayCaster& caster,
                               const samples::SampleSet& points, const Workers& workers,
                               Progress& progress) {
  Progress part;  // far below a second
  std::vector<uint32_t> ids(points.size());
  std::iota(ids.begin(), ids.end(), 0u);
  return {samples::make_discs(points, std::move(ids), samples::DiscArea::whole,
                              {scene, caster, 0, scene.first_world()}, workers, part),
          segments::SegmentEnd::first, workers, &progress};
}

}  // namespace

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

LightPilot::LightPilot(const scene::Scene& scene, const trace::RayCaster& caster,
                       samples::SampleSet places, const Workers& workers, Progress& progress)
    : scene_(scene),
      caster_(caster),
      places_(std::move(places)),
      index_(disc_index(scene, caster, places_, workers, progress)) {}

trace::Walk LightPilot::walk(uint32_t batches) const {
  return {scene_, caster_, {kSeed, batches, kBounces, false, 0, true}};
}

LightPilot::Given LightPilot::given(const trace::Light& light, bool wide) const {
  const trace::EnergyScale scale = trace::choose_scale({&light, 1}, kBounces);
  const auto quanta = trace::birth_quanta(light, scale, 1.0);
  const trace::Walk paths = walk(1);
  const double most = light.max_weight();
  Flights all(*this), weighed(*this);
  for (uint64_t i = 0; i < light.path_count; ++i) {
    const trace::Emission start = trace::emit(light, kSeed, i, 1);
    const auto add = [&](trace::Flight flight, const trace::Interaction& end, uint32_t bounce) {
      if (end.primitive == scene::kNone) return;
      if (bounce > 0 || !wide) all.add(flight, end.length, 0);
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
  Given out{read(all, scale.quantum), read(weighed, scale.quantum * most)};
  if (!wide) return out;
  const std::unique_ptr<const direct::LightShape> shape = direct::shape_of(light, 0, kSeed);
  for (size_t i = 0; i < points(); ++i) out.all[i] += shines(*shape, light.strength, i);
  return out;
}

double LightPilot::shines(const direct::LightShape& shape, Vec3f strength, size_t place) const {
  constexpr uint32_t kRays = 4;
  const double radius = double(places_.radius[place]);
  const direct::Receiver receiver{above(place), places_.normal[place]};
  double sum = 0;
  for (uint32_t k = 0; k < kRays; ++k) {
    const auto r = sobol::sample(k, combine(kSeed, place));
    const direct::LightShape::Glance ray = shape.glance(receiver, r[0], r[1]);
    if (ray.irradiance > 0 && !caster_.occluded_static(ray.origin, ray.direction, ray.to))
      sum += ray.irradiance / kRays;
  }
  return std::numbers::pi * radius * radius * sum * deltalux::photopic(Vec3d(strength));
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
