// SPDX-License-Identifier: Apache-2.0
// Prepares the tracing of a bake: discs, path counts of lights, memory forecasts, estimators.
#include "session/session_parts.h"

#include <algorithm>
#include <map>

#include "base/error.h"
#include "plan/allotment.h"
#include "samples/openness.h"
#include "samples/placement.h"
#include "session/pilot_paths.h"
#include "session/session.h"

namespace deltalux::session {
namespace {

constexpr float kFar = std::numeric_limits<float>::infinity();
constexpr size_t kGrain = 256;
// scene metres: how far above a surface a sample may lie that belongs to it
constexpr float kUnder = 1e-3f;
constexpr uint64_t kMinRays = 8;  // fewest gather rays per sample that an error message suggests
// bytes of memory: of a sample and its receiver, and in addition of its disc in an index
constexpr size_t kSampleBytes = 96, kDiscBytes = 160;
constexpr Box kEverywhere{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}};

/// Most samples of most scenes cast the standard number of rays.
double expected_rays(const State& s) {
  constexpr double kMoreRays = 0.2;
  return (1 + kMoreRays) * double(s.samples.size()) * double(s.options.gather_rays);
}

/// A scene of one object's triangles alone, in its local space, so that outlines of discs do not
/// depend on the pose, not even by rounding.
scene::Scene local_scene(const scene::Scene& scene, uint32_t object) {
  scene::Scene local;
  local.materials = scene.materials;
  local.group_count = scene.group_count;
  local.objects.push_back(scene.objects[object]);
  local.objects[0].movable = false;
  local.objects[0].pose = {};
  local.finish();
  return local;
}

/// Calls visit(object, its samples, scene, ground) for the static samples (object kNone), then for
/// those of each movable, with the scene of the ground alone.
template <class Visit>
void each_ground(const State& s, Progress& progress, const Visit& visit) {
  std::map<uint32_t, std::vector<uint32_t>> by_object;
  for (uint32_t i = 0; i < s.samples.size(); ++i) by_object[s.samples.attached[i]].push_back(i);
  visit(scene::kNone, std::move(by_object[scene::kNone]), s.scene,
        samples::Ground{s.scene, *s.caster, 0, s.scene.first_world()});
  for (auto& [object, ids] : by_object) {
    if (object == scene::kNone) continue;
    const scene::Scene local = local_scene(s.scene, object);
    const trace::RayCaster caster(local, progress);
    const uint32_t first = s.scene.objects[object].first_primitive;
    visit(object, std::move(ids), local, samples::Ground{s.scene, caster, first, kEverywhere});
  }
}

}  // namespace

double ray_bytes(const State& s, const Forecast& forecast, double rays, bool weighted) {
  const double told = double(s.samples.size()) * double(s.options.gather_rays);
  return std::min(rays, told) * forecast.per_ray.bytes(weighted) +
         std::max(0.0, rays - told) * gather::Looks::kAddedRays.bytes(weighted);
}

void Session::index_triangles(Progress& progress) {
  State& s = *state_;
  progress.begin("index triangles", 1);
  s.caster = std::make_unique<trace::RayCaster>(s.scene, progress);
  if (s.options.segment_end == segments::SegmentEnd::bounded) resolve_radii(progress);
  find_slacks(progress);
}

void Session::resolve_radii(Progress& progress) {
  State& s = *state_;
  samples::resolve_lengths(s.scene, *s.caster, s.options.paths, s.workers, progress, s.samples);
  s.largest_radius = 0;
  for (float r : s.samples.radius) s.largest_radius = std::max(s.largest_radius, r);
}

Parts Session::place_parts(Progress& progress, std::span<const float> openness) {
  State& s = *state_;
  resolve_radii(progress);
  const auto [from, end] = s.own_samples();
  Parts parts;
  parts.openness.assign(openness.begin(), openness.end());
  parts.openness.resize(s.samples.size(), 1.0f);
  each_ground(s, progress,
              [&](uint32_t object, std::vector<uint32_t> ids, const scene::Scene& scene,
                  const samples::Ground& ground) {
                samples::DiscSet discs = samples::make_discs(
                    s.samples, std::move(ids), s.options.disc_area, ground, s.workers, progress);
                if (openness.empty() && s.counts_openness())
                  samples::find_openness(discs, from, end, scene, ground.caster, s.workers,
                                         progress, parts.openness);
                if (object != scene::kNone) {
                  MovingPart part;
                  part.object = object;
                  for (size_t i = 0; i < discs.size(); ++i)
                    part.local.grow(Box{discs.centre[i], discs.centre[i]}.padded(discs.radius[i]));
                  parts.moving.push_back(std::move(part));
                }
                parts.pilots.emplace_back(std::move(discs), s.options.segment_end, s.workers);
              });
  return parts;
}

void Session::take_places(Parts& parts, bool openness_complete) {
  State& s = *state_;
  s.moving = std::move(parts.moving);
  s.openness = std::move(parts.openness);
  s.openness_complete = openness_complete;
}

void Session::find_slacks(Progress& progress) {
  State& s = *state_;
  s.slack.resize(s.samples.size());
  const float within = kUnder * samples::scene_metre(s.scene, *s.caster);
  each_ground(s, progress,
              [&](uint32_t, const std::vector<uint32_t>& ids, const scene::Scene&,
                  const samples::Ground& ground) {
                s.workers.for_blocks(ids.size(), kGrain, [&](size_t begin, size_t end) {
                  for (size_t i = begin; i < end; ++i)
                    s.slack[ids[i]] = samples::slack_under(ground, s.samples.point[ids[i]],
                                                           s.samples.normal[ids[i]], within);
                });
              });
}

void Session::make_estimators(Parts& parts, Progress& progress) {
  State& s = *state_;
  if (parts.pilots.empty())
    parts.pilots.emplace_back(samples::DiscSet{}, s.options.segment_end, s.workers);
  s.static_index = parts.pilots[0].release(s.plans[0].chosen, &progress);
  for (size_t i = 0; i < s.moving.size(); ++i)
    s.moving[i].index = parts.pilots[i + 1].release(s.plans[i + 1].chosen, &progress);
}

void Session::allot_paths(Progress& progress) {
  State& s = *state_;
  trace::allot_paths(s.lights,
                     plan::shares_by_use(s.scene, s.loaded_reflectance, *s.caster, s.samples,
                                         s.lights, s.workers, progress),
                     s.options.paths, kBatches);
  s.hold_paths();
  s.scale = trace::choose_scale(s.lights, s.options.max_bounces);
  s.group_sums();
  lay_out_cell_sums(s);
}

double Session::bytes_per_segment() const {
  const bool extended = state_->options.segment_end != segments::SegmentEnd::first;
  constexpr double kSpare = 1.05;  // chunks are not all full
  return kSpare *
         (sizeof(segments::BounceSegments::Chunk) / double(segments::BounceSegments::kChunk) +
          (extended ? double(sizeof(float)) : 0.0) +
          (state_->options.gather_rays ? double(sizeof(uint32_t)) : 0.0));
}

void Session::forecast_memory(const PilotPaths& paths) {
  const State& s = *state_;
  const double per_path = paths.walked ? double(paths.flights.size()) / double(paths.walked) : 1.0;
  const double fixed =
      double(s.samples.size()) * kSampleBytes + double(s.scene.primitives()) * 200.0 +
      // The last chunk of each bounce is partly empty. More paths reach more
      // bounces than the pilot paths.
      (1.5 * paths.deepest + 4.0) * double(sizeof(segments::BounceSegments::Chunk));
  forecast_.bytes_per_path = per_path * bytes_per_segment() + 1.0;
  forecast_.segments = uint64_t(per_path * double(paths.all));
  forecast_.bytes = size_t(forecast_.bytes_per_path * double(s.held.size()) + fixed);
}

void Session::refuse_beyond_limit() {
  const State& s = *state_;
  const uint64_t paths = s.held.size();
  if (s.counts_in_discs())
    forecast_.bytes += s.samples.size() * kDiscBytes + s.sum_count() * sizeof(int64_t);
  if (s.evaluates())
    forecast_.bytes += direct::DirectLight::forecast_bytes(s.samples.size(), s.scene.group_count,
                                                           s.lights, s.light_sampled);
  // Memory of gather rays, with what is needed only while they are cast.
  double rays = 0;
  if (s.gather && s.evaluates()) {
    forecast_.per_ray = pilot_rays();
    rays = ray_bytes(s, forecast_, expected_rays(s), true) +
           gather::Looks::forecast_working_bytes(s.samples.size(), double(s.options.gather_rays),
                                                 forecast_.per_ray);
    forecast_.bytes += size_t(rays) + gather::CellLight::forecast_bytes(s.gather->cells.size());
  }
  if (s.gather) forecast_.bytes += s.gather->cells.bytes() + s.gather->sums.bytes();
  forecast_.bytes += forecast_sharing();
  const double fixed = double(forecast_.bytes) - forecast_.bytes_per_path * double(paths);
  const double room = double(s.options.memory_limit) - fixed;
  // A little less than that: another path count has other pilot paths.
  forecast_.paths_that_fit = room > 0 ? uint64_t(0.95 * room / forecast_.bytes_per_path) : 0;
  if (!s.options.memory_limit || forecast_.bytes <= s.options.memory_limit) return;
  // Suggest fewer rays if the rays do not fit into the memory that everything else leaves.
  const double left = double(s.options.memory_limit) - (double(forecast_.bytes) - rays);
  const auto fewer = uint64_t(std::max(0.0, 0.95 * left / rays * s.options.gather_rays));
  const bool by_rays = rays > 0 && !forecast_.paths_that_fit && fewer >= kMinRays;
  const std::string found =
      s.holds_all() ? std::to_string(paths) + " paths"
                    : "the " + std::to_string(paths) + " paths of path_range and its sums";
  throw OptionError("memory: " + found + " would need about " +
                    std::to_string(forecast_.bytes >> 20) + " MiB, the limit is " +
                    std::to_string(s.options.memory_limit >> 20) + " MiB; about " +
                    (by_rays ? std::to_string(fewer) + " rays of each sample (gather)"
                             : std::to_string(forecast_.paths_that_fit) + " paths" +
                                   (s.holds_all() ? "" : " in a narrower path_range")) +
                    " would fit, or raise the memory limit");
}

bool Session::fits(const gather::RayCounts& rays) {
  const State& s = *state_;
  const size_t bytes = size_t(double(forecast_.bytes) +
                              ray_bytes(s, forecast_, double(rays.all()), !s.guiding.empty()) -
                              ray_bytes(s, forecast_, expected_rays(s), true));
  if (s.options.memory_limit && bytes > s.options.memory_limit) return false;
  forecast_.bytes = bytes;
  return true;
}

}  // namespace deltalux::session
