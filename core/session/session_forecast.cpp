// SPDX-License-Identifier: Apache-2.0
// Forecasts the memory of a bake, and refuses it beyond the limit.
#include "session/session_forecast.h"

#include <algorithm>

#include "base/error.h"
#include "session/paths/pilot_paths.h"

namespace deltalux::session {
namespace {

constexpr uint64_t kMinRays = 8;  // fewest gather rays per sample that an error message suggests
// bytes of memory: of a sample and its receiver, and in addition of its disc in an index
constexpr size_t kSampleBytes = 96, kDiscBytes = 160;

/// Most samples of most scenes cast the standard number of rays.
double expected_rays(const State& s) {
  constexpr double kMoreRays = 0.2;
  return (1 + kMoreRays) * double(s.samples.size()) * double(s.options.gather_rays);
}

}  // namespace

double ray_bytes(const State& s, const Forecast& forecast, double rays, bool weighted) {
  const double told = double(s.samples.size()) * double(s.options.gather_rays);
  return std::min(rays, told) * forecast.per_ray.bytes(weighted) +
         std::max(0.0, rays - told) * gather::Looks::kAddedRays.bytes(weighted);
}

void Session::forecast_memory(const PilotPaths& paths) {
  const State& s = *state_;
  const double per_path = paths.walked ? double(paths.flights.size()) / double(paths.walked) : 1.0;
  const double fixed =
      double(s.samples.size()) * kSampleBytes + double(s.scene.primitives()) * 200.0 +
      // The last chunk of each bounce is partly empty. More paths reach more
      // bounces than the pilot paths.
      (1.5 * paths.deepest + 4.0) * double(sizeof(segments::BounceSegments::Chunk));
  forecast_.bytes_per_path = per_path * s.paths.bytes_per_segment() + 1.0;
  forecast_.segments = uint64_t(per_path * double(paths.all));
  forecast_.bytes = size_t(forecast_.bytes_per_path * double(s.paths.held.size()) + fixed);
}

void Session::refuse_beyond_limit() {
  const State& s = *state_;
  const uint64_t paths = s.paths.held.size();
  if (s.counts_in_discs())
    forecast_.bytes += s.samples.size() * kDiscBytes + s.discs.sum_count() * sizeof(int64_t);
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

void Session::set_planning(const plan::Machine& machine, plan::Policy policy,
                           std::optional<double> frames, bool rebuilds) {
  Options& options = state_->options;
  options.machine = machine;
  options.policy = policy;
  options.expected_frames = frames.value_or(kExpectedFrames);
  options.rebuilds = rebuilds;
}

const std::vector<plan::PartPlan>& Session::plan(Progress& progress) {
  State& s = *state_;
  // Openness takes longer to compute than everything else here, and no cost depends on it.
  const std::vector<float> open(s.samples.size(), 1.0f);
  s.index_triangles(progress);
  s.resolve_radii(progress);
  PlacedDiscs placed = s.discs.place(progress, open);
  s.discs.take(placed);
  s.allot_paths(progress);
  s.paths.held = s.held();
  const PilotPaths pilot = walk_pilot_paths(s, progress);
  forecast_memory(pilot);
  s.choose_direct(double(forecast_.segments));
  s.discs.plan(placed, pilot, true, progress);
  return s.discs.plans;
}

}  // namespace deltalux::session
