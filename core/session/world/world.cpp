// SPDX-License-Identifier: Apache-2.0
// Checks what the user gives, orders the samples, and chooses which sums the paths of each light
// add to.
#include "session/world/world.h"

#include <cmath>
#include <string>

#include "base/cpu.h"
#include "base/curve_order.h"
#include "base/error.h"
#include "direct/light_shape.h"

namespace deltalux::session {
namespace {

void check_samples(const scene::Scene& scene, samples::SampleSet& samples) {
  const size_t n = samples.size();
  if (samples.normal.size() != n || samples.radius.size() != n || samples.attached.size() != n)
    throw OptionError("samples: points, normals, radius and attached differ in length");
  for (size_t i = 0; i < n; ++i) {
    const std::string where = "sample " + std::to_string(i) + ": ";
    const Vec3f p = samples.point[i];
    const float l = length(samples.normal[i]);
    const float far = std::max({std::fabs(p.x), std::fabs(p.y), std::fabs(p.z)});
    if (!std::isfinite(p.x + p.y + p.z) || far > kFarthest)
      throw OptionError(where + "point: found a coordinate that is not finite or beyond 1e15 m");
    if (!(l > 0) || !std::isfinite(l))
      throw OptionError(where + "normal is zero or not finite, expected a direction");
    samples.normal[i] = normalize(samples.normal[i]);
    const float r = samples.radius[i];
    if (!std::isnan(r) && !(r > 0 && r <= kFarthest))
      throw OptionError(where + "radius: found " + std::to_string(r) +
                        ", expected positive metres up to 1e15");
    const uint32_t object = samples.attached[i];
    if (object != scene::kNone &&
        (object >= scene.objects.size() || !scene.objects[object].movable))
      throw OptionError(where + "attached to something that is not movable");
  }
}

/// Extends the scene's world box to hold all samples: they may lie outside of all geometry, where
/// light that leaves the scene passes.
void reach_samples(World& s) {
  // Automatic radii are hardly larger than this.
  const float radius = 0.02f * s.scene.first_world().diagonal();
  s.sample_bounds.assign(s.scene.objects.size(), {});
  const auto disc = [&](size_t i) {
    const float own = std::isnan(s.samples.radius[i]) ? radius : s.samples.radius[i];
    return Box{s.samples.point[i], s.samples.point[i]}.padded(own);
  };
  for (size_t i = 0; i < s.samples.size(); ++i) {
    const uint32_t object = s.samples.attached[i];
    const Vec3f p = s.samples.point[i];
    if (object != scene::kNone)
      s.sample_bounds[object].grow(p);
    else if (!s.scene.first_world().contains(Box{p, p}))
      s.scene.extend_world(disc(i));
  }
  for (uint32_t i = 0; i < s.scene.objects.size(); ++i) {
    const Box own = s.bounds_at(i, s.scene.objects[i].pose);
    if (s.scene.objects[i].movable && !s.scene.first_world().contains(own))
      s.scene.extend_world(own);
  }
}

/// Orders samples along a Hilbert curve, and samples at the same point by their normals, so that
/// the order in which they were given does not matter.
std::vector<uint32_t> places_in_order(const samples::SampleSet& samples) {
  std::vector<uint64_t> ties(samples.size());
  for (size_t i = 0; i < ties.size(); ++i)
    ties[i] = direct::place_key(samples.point[i], samples.normal[i]);
  return curve_order(samples.point, Curve::hilbert, nullptr, ties);
}

}  // namespace

void assign_sums(std::span<trace::Light> lights, std::vector<SumGroup>& groups) {
  for (trace::Light& light : lights) {
    const SumGroup own{std::min(light.group, kMaxOwnGroups - 1), light.finer};
    const auto found = std::find(groups.begin(), groups.end(), own);
    light.sums = uint32_t(found - groups.begin());
    if (found == groups.end()) groups.push_back(own);
  }
}

World::World(scene::Scene given_scene, samples::SampleSet given_samples, const Options& asked)
    : World(asked) {
  isa();  // refuses a wrong DELTALUX_ISA before any work
  if (options.paths < 1) throw OptionError("paths: found 0, expected at least 1");
  if (options.paths > 0xfffffff0u) throw OptionError("paths: expected at most 4e9");
  if (options.range &&
      (options.range->first > options.range->last || options.range->last > options.paths))
    throw OptionError("path_range: found (" + std::to_string(options.range->first) + ", " +
                      std::to_string(options.range->last) +
                      "), expected (first, last) with 0 <= first <= last <= " +
                      std::to_string(options.paths) + ", the number of paths");
  if (options.max_bounces < 1 || options.max_bounces > 10'000)
    throw OptionError("max_bounces: expected 1 to 10000");
  given_scene.finish();
  check_samples(given_scene, given_samples);
  scene = std::move(given_scene);
  given = places_in_order(given_samples);
  samples = given_samples.reordered(given);
  reach_samples(*this);
  group_factor.assign(scene.group_count, 1.0);
  loaded_objects = uint32_t(scene.objects.size());
  lights = loaded_lights = trace::find_lights(scene);
  trace::allot_paths(lights, trace::shares_by_power(lights), options.paths, kBatches);
  scale = trace::choose_scale(lights, options.max_bounces);
  group_sums();
  for (const scene::Material& material : scene.materials)
    loaded_reflectance.push_back(material.reflectance);
}

void World::take_given(const World& other) {
  scene = other.scene;
  samples = other.samples;
  given = other.given;
  sample_bounds = other.sample_bounds;
  lights = other.lights;
  group_factor = other.group_factor;
  scale = other.scale;
  sum_groups = other.sum_groups;
  loaded_reflectance = other.loaded_reflectance;
  loaded_objects = other.loaded_objects;
  loaded_lights = other.loaded_lights;
}

bool World::is_as_loaded() const {
  if (lights.size() != loaded_lights.size()) return false;
  for (size_t l = 0; l < lights.size(); ++l)
    if (!trace::sends_alike(lights[l], loaded_lights[l])) return false;
  for (size_t m = 0; m < loaded_reflectance.size(); ++m)
    if (!(scene.materials[m].reflectance == loaded_reflectance[m])) return false;
  return true;
}

void World::count_as_loaded(uint32_t objects) {
  loaded_objects = objects;
  std::erase_if(loaded_lights, [&](const trace::Light& light) {
    return light.object != scene::kNone && light.object >= objects;
  });
}

scene::Scene World::as_loaded() const {
  scene::Scene out = scene;
  while (out.objects.size() > loaded_objects) out.drop_last_object();
  for (scene::Object& object : out.objects) object.present = !object.movable;
  for (size_t m = 0; m < loaded_reflectance.size(); ++m)
    out.materials[m].reflectance = loaded_reflectance[m];
  if (loaded_objects < scene.objects.size() && loaded_objects > 0)
    out.group_count = scene.groups_up_to(loaded_objects - 1);
  out.hold({});
  return out;
}

trace::Light World::as_loaded(size_t light) const {
  trace::Light out = loaded_lights[light];
  const trace::Light& now = lights[light];
  out.first_path = now.first_path, out.path_count = now.path_count;
  out.map = now.map, out.aims = now.aims;
  out.finer = now.finer, out.sums = now.sums;
  return out;
}

std::vector<float> World::as_given(const std::vector<float>& own) const {
  std::vector<float> out(own.size());
  for (size_t i = 0; i < own.size(); ++i) out[given[i]] = own[i];
  return out;
}

}  // namespace deltalux::session
