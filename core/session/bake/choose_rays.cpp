// SPDX-License-Identifier: Apache-2.0
// The rule is chosen at places on lit cells; pilot rays of each sample then apply it.
#include "session/bake/choose_rays.h"

#include <algorithm>

#include "session/bake/forecast.h"
#include "session/rays/pilots.h"

namespace deltalux::session {
namespace {

// places from which the memory of all rays is predicted, approximately
constexpr size_t kPlaces = 512;

/// Casts a few rays from these receivers, to predict the memory of all rays.
gather::GatherHits::PerRay few_rays(const gather::Context& context, uint64_t seed,
                                    const Workers& workers) {
  constexpr uint32_t kRays = 32;
  const std::vector<int8_t> as_told(context.receivers.size());
  gather::GatherHits hits({as_told, kRays}, seed);
  Progress part;
  hits.cast(context, workers, part);
  return hits.per_ray();
}

}  // namespace

gather::GatherHits::PerRay pilot_rays(const State& s) {
  std::vector<Vec3f> points, normals;
  const size_t stride = std::max<size_t>(1, s.samples.size() / kPlaces);
  for (size_t i = 0; i < s.samples.size(); i += stride) {
    const uint32_t object = s.samples.attached[i];
    const Pose pose = object == scene::kNone ? Pose{} : s.scene.objects[object].pose;
    points.push_back(pose.point(s.samples.point[i]));
    normals.push_back(pose.direction(s.samples.normal[i]));
  }
  const std::vector<direct::Receiver> receivers = s.rays.receivers_at(points, normals);
  return few_rays(s.rays.context(receivers, {}), s.options.seed ^ kPilotSeed, s.workers);
}

void choose_need(State& c, const gather::Evaluation& now) {
  const std::vector<direct::Receiver> places = gather::lit_places(c.rays.lit_cells(now));
  c.rays.guiding.need = {};
  if (places.empty()) return;
  const uint32_t rays = c.options.gather_rays;
  const std::vector<Vec3d> direct =
      irradiance_of(*c.direct.at(places, c.light_sampled), c.group_factor, 0, places.size());
  Progress part;
  const std::vector<gather::SeenTargets> around = c.rays.targets_at(places, rays, part);
  c.rays.guiding.need =
      gather::RayNeed(pilots_of(c.rays, {places, around, direct}, rays, now), rays);
}

std::vector<int8_t> choose_doublings(const State& c, size_t first, size_t last,
                                     const gather::Evaluation& now, Progress& progress) {
  std::vector<int8_t> doublings(last - first);
  if (!needs_pilots(c.rays)) return doublings;
  const uint32_t rays = c.options.gather_rays;
  progress.begin("find noisy places", last - first);
  const size_t together = seen_together(rays);
  // A place that is dark while a lamp stands elsewhere may be noisy once it comes.
  const bool moving_lamps =
      std::any_of(c.lights.begin(), c.lights.end(), [&](const trace::Light& light) {
        return light.object != scene::kNone && c.scene.objects[light.object].movable;
      });
  for (size_t at = first; at < last; at += together) {
    const size_t count = std::min(together, last - at);
    const std::span receivers = std::span(c.direct.receivers).subspan(at, count);
    Progress part(&progress);
    const std::vector<gather::SeenTargets> seen = c.rays.targets_at(receivers, rays, part);
    const std::vector<Vec3d> straight =
        irradiance_of(*c.direct.at(receivers, c.light_sampled), c.group_factor, 0, count);
    std::vector<int8_t> own = piloted(c.rays, {receivers, seen, straight}, rays, now);
    for (int8_t& one : own)
      if (moving_lamps && one < 0) one = 0;
    std::copy(own.begin(), own.end(), doublings.begin() + long(at - first));
    progress.advance(count);
    progress.check();
  }
  return doublings;
}

void fit_rays(State& s) {
  // Samples with more rays, or fewer, may start more chains per ray than others.
  const gather::RayCounts counts(s.rays.guiding.doublings, s.options.gather_rays);
  std::vector<direct::Receiver> some;  // spaced evenly among all rays
  for (size_t i = 0; i < s.direct.receivers.size(); ++i)
    if (counts.first(i + 1) * kPlaces >= some.size() * counts.all())
      some.push_back(s.direct.receivers[i]);
  const double all = double(counts.all());
  const bool weighted = !s.rays.guiding.empty();
  const size_t before = s.forecast.bytes;
  s.forecast.bytes =
      size_t(double(before) +
             all * few_rays(s.rays.context(some, {}), s.options.seed ^ kPilotSeed, s.workers)
                       .bytes(weighted) -
             ray_bytes(s, all, weighted));
  // If memory is short, all samples cast the standard number of rays, as was forecast.
  if (fits(s, counts)) return;
  s.forecast.bytes = before;
  s.rays.guiding.need = {};
  s.rays.guiding.doublings.assign(s.direct.receivers.size(), 0);
}

}  // namespace deltalux::session
