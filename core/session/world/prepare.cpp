// SPDX-License-Identifier: Apache-2.0
// What a bake chooses before its layers: ray caster, radii, paths of each light, and which lights
// get shadow rays.
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
  trace::allot_paths(
      lights,
      plan::shares_by_use(scene, loaded_reflectance, *caster, samples, lights, workers, progress),
      options.paths, kBatches);
  scale = trace::choose_scale(lights, options.max_bounces);
  group_sums();
}

void World::choose_direct(double segments) {
  light_sampled.assign(lights.size(), options.direct == DirectMode::sampled);
  if (options.direct != DirectMode::automatic) return;
  // A shadow ray costs a tenth to a thirtieth of a segment that is traced, stored and deposited.
  // Shadow rays may cost as much as the paths; lights with most power per ray come first. With a
  // final gather, direct light by discs would dominate the error, and one light by discs costs the
  // discs of all; so shadow rays may cost several times what the gather rays do.
  const double gathered =
      options.gather_rays ? std::max(kWorthRays, double(options.gather_rays)) : 0.0;
  double budget = std::max(15.0 * segments, kPerGatherRay * gathered * double(samples.size()));
  std::vector<size_t> order(lights.size());
  std::iota(order.begin(), order.end(), size_t(0));
  const auto rays = [&](size_t i) {
    return direct::DirectLight::estimated_rays(lights[i], samples.size(), lights.size());
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
    light_sampled[i] = 1;
  }
}

}  // namespace deltalux::session
