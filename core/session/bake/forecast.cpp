// SPDX-License-Identifier: Apache-2.0
// The forecast counts what every layer will hold.
#include "session/bake/forecast.h"

#include <algorithm>
#include <string>

#include "base/error.h"
#include "session/bake/choice_state.h"
#include "session/bake/choose_rays.h"

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

/// Expected memory for what a session with a range of the paths gives to others or takes from them.
size_t forecast_sharing(const State& s) {
  if (!s.options.range) return 0;
  size_t sum = s.holds_none() ? 0 : sizeof(int64_t) * s.discs.sum_count();
  if (!s.gathers()) return sum;
  // Each of them chooses by as many paths as a session of all; these are gone once its own come.
  const auto choosing = double(std::min(s.options.paths, kMostChoicePaths));
  const auto more = std::max(0.0, choosing - double(s.paths.held.size()));
  sum += size_t(s.forecast.bytes_per_path * more);
  if (!s.holds_none())  // what path_changes() returned; what gather rays cast for others need
    sum += s.cells.sums.quanta.size() * sizeof(int64_t) +
           s.samples.size() * sizeof(direct::Receiver) +
           gather::CellLight::forecast_bytes(s.cells.division.size());
  return sum;
}

}  // namespace

double ray_bytes(const State& s, double rays, bool weighted) {
  const double told = double(s.samples.size()) * double(s.options.gather_rays);
  return std::min(rays, told) * s.forecast.per_ray.bytes(weighted) +
         std::max(0.0, rays - told) * gather::GatherHits::kAddedRays.bytes(weighted);
}

void forecast_memory(State& s, const PilotPaths& paths) {
  const double per_path = paths.walked ? double(paths.flights.size()) / double(paths.walked) : 1.0;
  const double fixed =
      double(s.samples.size()) * kSampleBytes + double(s.scene.primitives()) * 200.0 +
      double(s.scene.texture_bytes()) +
      // The last chunk of each bounce is partly empty. More paths reach more
      // bounces than the pilot paths.
      (1.5 * paths.deepest + 4.0) * double(sizeof(segments::BounceSegments::Chunk));
  s.forecast.bytes_per_path = per_path * s.paths.bytes_per_segment() + 1.0;
  s.forecast.segments = uint64_t(per_path * double(paths.all));
  s.forecast.bytes = size_t(s.forecast.bytes_per_path * double(s.paths.held.size()) + fixed);
}

void refuse_beyond_limit(State& s) {
  const uint64_t paths = s.paths.held.size();
  if (s.counts_in_discs())
    s.forecast.bytes += s.samples.size() * kDiscBytes + s.discs.sum_count() * sizeof(int64_t);
  if (s.evaluates())
    s.forecast.bytes += direct::DirectLight::forecast_bytes(s.samples.size(), s.scene.group_count,
                                                            s.lights, s.light_sampled);
  // Memory of gather rays, with what is needed only while they are cast.
  double rays = 0;
  if (s.gathers() && s.evaluates()) {
    s.forecast.per_ray = pilot_rays(s);
    rays = ray_bytes(s, expected_rays(s), true) +
           gather::GatherHits::forecast_working_bytes(
               s.samples.size(), double(s.options.gather_rays), s.forecast.per_ray);
    s.forecast.bytes += size_t(rays) + gather::CellLight::forecast_bytes(s.cells.division.size());
  }
  if (s.gathers()) s.forecast.bytes += s.cells.division.bytes() + s.cells.sums.bytes();
  s.forecast.bytes += forecast_sharing(s);
  const double fixed = double(s.forecast.bytes) - s.forecast.bytes_per_path * double(paths);
  const double room = double(s.options.memory_limit) - fixed;
  // A little less than that: another path count has other pilot paths.
  s.forecast.paths_that_fit = room > 0 ? uint64_t(0.95 * room / s.forecast.bytes_per_path) : 0;
  if (!s.options.memory_limit || s.forecast.bytes <= s.options.memory_limit) return;
  // Suggest fewer rays if the rays do not fit into the memory that everything else leaves.
  const double left = double(s.options.memory_limit) - (double(s.forecast.bytes) - rays);
  const auto fewer = uint64_t(std::max(0.0, 0.95 * left / rays * s.options.gather_rays));
  const bool by_rays = rays > 0 && !s.forecast.paths_that_fit && fewer >= kMinRays;
  const std::string found =
      s.holds_all() ? std::to_string(paths) + " paths"
                    : "the " + std::to_string(paths) + " paths of path_range and its sums";
  throw OptionError("memory: " + found + " would need about " +
                    mebibytes(double(s.forecast.bytes)) + ", the limit is " +
                    mebibytes(double(s.options.memory_limit)) + "; about " +
                    (by_rays ? std::to_string(fewer) + " rays of each sample (gather)"
                             : std::to_string(s.forecast.paths_that_fit) + " paths" +
                                   (s.holds_all() ? "" : " in a narrower path_range")) +
                    " would fit, or raise the memory limit");
}

bool fits(State& s, const gather::RayCounts& rays) {
  const size_t bytes =
      size_t(double(s.forecast.bytes) + ray_bytes(s, double(rays.all()), !s.rays.guiding.empty()) -
             ray_bytes(s, expected_rays(s), true));
  if (s.options.memory_limit && bytes > s.options.memory_limit) return false;
  s.forecast.bytes = bytes;
  return true;
}

}  // namespace deltalux::session
