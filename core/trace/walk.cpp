// SPDX-License-Identifier: Apache-2.0
// Traces single segments; callers process many in parallel.
#include "trace/walk.h"

#include <algorithm>
#include <cmath>

#include "base/assertion.h"
#include "base/direction.h"
#include "base/error.h"
#include "base/random.h"
#include "trace/scatter.h"

namespace deltalux::trace {
namespace {

// Dimensions of the random numbers that round; surfaces use lower ones.
constexpr uint32_t kRound = 255, kRoundBirth = 254;

double brightest(const Vec3d& power) { return std::max({power.x, power.y, power.z}); }

/// The largest power of any of the light's paths, in any pose.
double brightest_path(const Light& light) {
  return light.max_weight() * light.max_power * brightest(light.power) /
         double(std::max<uint64_t>(1, light.path_count));
}

bool is_finite(Vec3f p) { return std::isfinite(p.x + p.y + p.z); }

bool is_unit(Vec3f v) { return std::fabs(dot(v, v) - 1) < 1e-3f; }

bool is_length(float t) { return t >= 0 && std::isfinite(t); }

}  // namespace

Flight Walk::birth(const Light& light, uint64_t index, const Vec3d& quanta) const {
  return birth(light, index, emit(light, options_.seed, index, options_.batches), quanta);
}

Flight Walk::birth(const Light& light, uint64_t index, const Emission& e,
                   const Vec3d& quanta) const {
  Flight flight;
  flight.direction = encode_direction(e.direction);
  flight.origin = e.origin;
  if (light.is_parallel()) {
    // Start where the ray enters the world box. A ray that misses it keeps its start and ends
    // there. The light's rectangle is that of the first box: begin outside of a larger one.
    const Vec3f w = decode_direction(flight.direction);
    const bool larger = !(scene_.world() == scene_.first_world());
    const Vec3f from = larger ? e.origin - w * scene_.beyond() : e.origin;
    const float entry = SlabRay(from, w).entry(scene_.world(), std::numeric_limits<float>::max());
    if (entry < std::numeric_limits<float>::infinity()) flight.origin = from + w * entry;
  }
  flight.path = uint32_t(light.first_path + index);
  const float random = PathRandom(options_.seed, flight.path)(0, kRoundBirth);
  for (int c = 0; c < 3; ++c) flight.power[c] = whole_quanta(quanta[c] * double(e.weight), random);
  DELTALUX_ASSERT(is_unit(e.direction) && is_finite(flight.origin));
  DELTALUX_ASSERT(*std::max_element(flight.power, flight.power + 3) <= 1u << 31);
  return flight;
}

Hit Walk::meet(const Flight& flight) const {
  const Vec3f direction = decode_direction(flight.direction);
  const Hit hit = options_.static_only ? caster_.closest_static(flight.origin, direction)
                                       : caster_.closest(flight.origin, direction);
  if (hit.valid()) scene_.fetch_point(hit.primitive);
  return hit;
}

void Walk::fetch(std::span<const Hit> hits) const {
  for (const Hit& hit : hits)
    if (hit.valid()) scene_.fetch_tint(hit.primitive, hit.u, hit.v);
}

Interaction Walk::scatter(const Flight& flight, uint32_t bounce, const Hit& hit) const {
  const Vec3f w = decode_direction(flight.direction);
  Interaction interaction;
  interaction.primitive = hit.primitive;
  if (!hit.valid()) {
    interaction.length = interaction.extended =
        distance_to_border(scene_.world(), flight.origin, w);
    DELTALUX_ASSERT(is_length(interaction.length));
    return interaction;
  }
  DELTALUX_ASSERT(is_length(hit.t));
  interaction.length = interaction.extended = hit.t;
  const scene::Material& surface = scene_.material_of(hit.primitive);
  // Behind a surface that lets light pass, the next segment goes on.
  if (options_.second_hit && !surface.kind->transmits(surface)) {
    const float border = distance_to_border(scene_.world(), flight.origin, w);
    const float limit = std::max(hit.t, std::min(hit.t + options_.second_reach, border));
    const float beyond = surface_slack(flight.origin, w, hit, scene_.slack_of(hit.primitive));
    const Hit second = caster_.closest(flight.origin, w, hit.t + beyond, limit);
    interaction.extended = second.valid() ? second.t : limit;
    DELTALUX_ASSERT(is_length(interaction.extended) && interaction.extended >= interaction.length);
  }
  if (bounce + 1 >= options_.max_bounces) return interaction;
  surfaces::Departure out;
  const surfaces::BounceRandom random(options_.seed, flight.path, bounce);
  if (!surface.kind->scatter(surface, {w, hit.normal, scene_.point_on(hit.primitive, hit.u, hit.v)},
                             random, out))
    return interaction;
  interaction.survives = true;
  interaction.lobe = out.lobe;
  const float plane = scene_.slack_of(hit.primitive);
  interaction.next.origin = out.lobe == surfaces::Lobe::straight
                                ? pass_surface(flight.origin, w, hit, plane)
                                : leave_surface(flight.origin, w, hit, out.normal, plane);
  // What passes straight keeps its direction to the last bit.
  interaction.next.direction =
      out.lobe == surfaces::Lobe::straight ? flight.direction : encode_direction(out.direction);
  for (int c = 0; c < 3; ++c)
    interaction.next.power[c] =
        whole_quanta(double(flight.power[c]) * out.throughput[c], random(kRound));
  interaction.next.path = flight.path;
  DELTALUX_ASSERT(is_finite(interaction.next.origin));
  // choose_scale() counts on no path gaining power.
  for (int c = 0; c < 3; ++c) DELTALUX_ASSERT(interaction.next.power[c] <= flight.power[c]);
  return interaction;
}

EnergyScale choose_scale(std::span<const Light> lights, uint32_t max_bounces) {
  double most = 0, paths = 0;
  for (const Light& light : lights) {
    paths += double(light.path_count);
    most = std::max(most, brightest_path(light));
  }
  EnergyScale scale;
  while (scale.digits > 1 && paths > double(scale.most_paths(max_bounces))) --scale.digits;
  if (most > 0) scale.quantum = std::ldexp(most, -scale.digits);
  return scale;
}

int choose_fineness(const Light& light, const EnergyScale& scale) {
  constexpr int kStep = 9;  // so that similar lights share their sums
  const double most = brightest_path(light);
  if (!(most > 0)) return 0;
  const double digits = scale.digits - std::log2(most / scale.quantum);
  constexpr double kSlack = 1e-9;  // the brightest path has no digit to spare, up to rounding
  const double steps = std::floor(std::clamp(digits / kStep + kSlack, -1e3, 1e3));
  return std::clamp(kStep * int(steps), kLeastFineness, kMostFineness);
}

Vec3d birth_quanta(const Light& light, const EnergyScale& scale, double factor) {
  const Vec3d quanta = light.power * (factor / double(light.path_count) / scale.of(light.finer));
  if (!(brightest(quanta) * light.max_weight() <= std::ldexp(2.0, scale.digits)))
    throw OptionError(
        "light: a path would carry more than the session's integer scale holds; "
        "start a new session with this light in the scene");
  return quanta;
}

}  // namespace deltalux::trace
