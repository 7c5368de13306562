// SPDX-License-Identifier: Apache-2.0
// What a bake chooses before its layers: ray caster, radii, paths of each light, and which lights
// get shadow rays.
#include <algorithm>
#include <cmath>
#include <numeric>

#include "direct/direct_light.h"
#include "plan/allotment.h"
#include "samples/placement.h"
#include "session/world/ground.h"
#include "session/world/world.h"

namespace deltalux::session {
namespace {

constexpr size_t kGrain = 256;
// All shadow rays are worth at least this many gather rays per sample, and each of those as many
// shadow rays: a gather ray takes about a microsecond with its chain, a shadow ray 40 ns.
constexpr double kWorthRays = 256, kPerGatherRay = 200;

/// By sample: Scene::slack_of() of the surface that it lies on.
std::vector<float> find_slacks(const World& world, Progress& progress) {
  std::vector<float> slack(world.samples.size());
  const float within = kUnder * samples::scene_metre(world.scene, *world.caster);
  each_ground(world, progress,
              [&](uint32_t, const std::vector<uint32_t>& ids, const scene::Scene&,
                  const samples::Ground& ground) {
                world.workers.for_blocks(ids.size(), kGrain, [&](size_t begin, size_t end) {
                  for (size_t i = begin; i < end; ++i)
                    slack[ids[i]] = samples::slack_under(ground, world.samples.point[ids[i]],
                                                         world.samples.normal[ids[i]], within);
                });
              });
  return slack;
}

/// How many segments all paths of the loaded lights would have in `scene`, World::as_loaded(); from
/// a few paths.
double expected_segments(const World& world, const scene::Scene& scene) {
  const trace::Walk walk(scene, *world.caster,
                         {world.options.seed, kBatches, world.options.max_bounces, false, 0, true});
  std::vector<trace::Light> lights;
  for (size_t l = 0; l < world.loaded_lights.size(); ++l) lights.push_back(world.as_loaded(l));
  uint64_t walked = 0, segments = 0;
  world.each_pilot_path([&](uint32_t l, uint64_t i) {
    const auto quanta = trace::birth_quanta(lights[l], world.scale, 1.0);
    walk.follow(walk.birth(lights[l], i, quanta), [&](const auto&...) { ++segments; });
    ++walked;
  });
  return walked ? double(segments) / double(walked) * double(world.all_paths()) : 0.0;
}

/// The loaded lights whose direct light comes from shadow rays. `scene`: World::as_loaded().
std::vector<uint8_t> choose_direct(const World& world, const scene::Scene& scene) {
  const std::vector<trace::Light>& lights = world.loaded_lights;
  std::vector<uint8_t> chosen(lights.size(), world.options.direct == DirectMode::sampled);
  if (world.options.direct != DirectMode::automatic) return chosen;
  // A shadow ray costs a tenth to a thirtieth of a segment that is traced, stored and deposited.
  // Shadow rays may cost as much as the paths; lights with most power per ray come first. With a
  // final gather, direct light by discs would dominate the error, and one light by discs costs the
  // discs of all; so shadow rays may cost several times what the gather rays do.
  const double gathered =
      world.gathers() ? std::max(kWorthRays, double(world.options.gather_rays)) : 0.0;
  double budget = std::max(15.0 * expected_segments(world, scene),
                           kPerGatherRay * gathered * double(world.samples.size()));
  std::vector<size_t> order(lights.size());
  std::iota(order.begin(), order.end(), size_t(0));
  const auto rays = [&](size_t i) {
    return direct::DirectLight::estimated_rays(lights[i], world.samples.size(), lights.size());
  };
  const auto worth = [&](size_t i) {
    const Vec3d p = lights[i].power * lights[i].max_power;
    return (p.x + p.y + p.z) / std::max(1.0, rays(i));
  };
  std::sort(order.begin(), order.end(),
            [&](size_t a, size_t b) { return worth(a) != worth(b) ? worth(a) > worth(b) : a < b; });
  for (size_t i : order) {
    if (rays(i) > budget) continue;
    budget -= rays(i);
    chosen[i] = 1;
  }
  return chosen;
}

}  // namespace

void World::index_triangles(Progress& progress) {
  progress.begin("index triangles", 1);
  caster = std::make_unique<trace::RayCaster>(scene, progress);
  if (options.segment_end == segments::SegmentEnd::bounded) resolve_radii(progress);
  slack = find_slacks(*this, progress);
}

void World::resolve_radii(Progress& progress) {
  samples::resolve_lengths(scene, *caster, options.paths, workers, progress, samples);
  largest_radius = 0;
  for (const float radius : samples.radius) largest_radius = std::max(largest_radius, radius);
}

void World::allot_paths(Progress& progress) {
  lights.resize(loaded_lights.size());
  const scene::Scene loaded = as_loaded();
  path_shares = plan::shares_by_use(loaded, *caster, samples, lights, workers, progress);
  trace::allot_paths(lights, path_shares, options.paths, kBatches);
  scale = trace::choose_scale(lights, options.max_bounces);
  group_sums();
  light_sampled = choose_direct(*this, loaded);
  add_lights(loaded_objects);
}

size_t World::add_lights(uint32_t first) {
  const bool sampled = samples_added_lights();
  const size_t before = lights.size();
  size_t first_lights = 0;
  for (uint32_t i = first; i < scene.objects.size(); ++i) {
    const bool dark = lights.empty();
    for (trace::Light& light : added_lights(*this, scene, i, scene.groups_up_to(i))) {
      light_sampled.push_back(sampled);
      lights.push_back(std::move(light));
    }
    if (!dark || lights.empty()) continue;
    scale = trace::choose_scale(lights, options.max_bounces);
    first_lights = lights.size();
  }
  if (first_lights)
    group_sums();
  else if (lights.size() != before)
    assign_sums(std::span(lights).subspan(before), sum_groups);
  return first_lights;
}

std::vector<trace::Light> added_lights(const World& w, const scene::Scene& scene, uint32_t object,
                                       uint32_t groups) {
  // quanta of a path: half of what the brightest path of the other lights carries
  const double even = std::ldexp(0.5, w.scale.digits);
  std::vector<trace::Light> lights = trace::find_lights(scene, object);
  uint64_t next = w.lights.empty() ? 0 : w.lights.back().first_path + w.lights.back().path_count;
  const double paths = double(w.options.paths), count = double(lights.size());
  const double floor = trace::kGroupFloor / std::max(2u, groups) * paths / count;
  for (trace::Light& light : lights) {
    double wanted = paths / count;  // in a scene without lights: all paths
    if (!w.lights.empty()) {
      const double quanta =
          std::max({light.power.x, light.power.y, light.power.z}) / w.scale.quantum;
      wanted = std::max(quanta / even, floor);
    }
    light.first_path = next;
    light.path_count = kBatches * uint64_t(std::clamp(wanted / kBatches, 1.0, 0x1p40));
    next += light.path_count;
    // The first lights of a dark scene have no scale yet, see World::group_sums().
    if (!w.lights.empty()) light.finer = trace::choose_fineness(light, w.scale);
  }
  return lights;
}

}  // namespace deltalux::session
