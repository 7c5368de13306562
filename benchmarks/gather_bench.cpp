// SPDX-License-Identifier: Apache-2.0
// The final gather on a real scene, every figure a ratio of CPU times within this process:
//   gather_bench DUMP PATHS RAYS STEP -> one JSON object on stdout
// STEP: how far the movable goes, metres.
#include <cstdio>
#include <cstdlib>

#include "gather/aim/directions.h"
#include "raw_rays.h"
#include "scene_dump.h"
#include "timing.h"

using namespace deltalux;
using namespace deltalux::benchmarks;

namespace {

/// Of every fourth sample.
Rays sample_rays(const session::State& state, uint32_t count) {
  const gather::Directions directions(count, 7);
  Rays rays;
  for (size_t i = 0; i < state.samples.size(); i += 4)
    for (uint32_t ray = 0; ray < count; ++ray) {
      const Vec3f n = state.samples.normal[i];
      rays.origin.push_back(state.samples.point[i] + n * 1e-3f);
      rays.direction.push_back(directions(uint32_t(i), ray, n));
    }
  return rays;
}

}  // namespace

// long: one measurement after another, each of a few lines.
int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: gather_bench DUMP PATHS RAYS STEP\n");
    return 2;
  }
  Dump dump = read_dump(argv[1]);
  session::Options options;
  options.paths = std::strtoull(argv[2], nullptr, 10);
  options.gather_rays = uint32_t(std::strtoul(argv[3], nullptr, 10));
  options.threads = 1;
  const double step = std::atof(argv[4]);
  const size_t samples = dump.samples.size();
  const uint32_t object = first_movable(dump.scene);
  session::Session session(std::move(dump.scene), std::move(dump.samples), options);
  Progress progress;
  session.bake(progress);
  const double rays = double(samples) * options.gather_rays;

  const Rays raw_rays = sample_rays(session.state(), options.gather_rays);
  std::vector<double> raw, cast, look_up, full;
  std::vector<double> irradiance(3 * samples), error(3 * samples);
  for (int turn = 0; turn < 3; ++turn) {
    raw.push_back(raw_ray_ns(*session.state().caster, raw_rays));
    double cpu = cpu_seconds(), wall = wall_seconds();
    const session::Frame done = session.recompute(progress);
    full.push_back(1e3 * (cpu_seconds() - cpu));
    cast.push_back(1e6 * stage(done, "gather", (cpu_seconds() - cpu) / (wall_seconds() - wall)) /
                   rays);
    cpu = cpu_seconds();
    session.read(irradiance.data(), error.data());
    look_up.push_back(1e9 * (cpu_seconds() - cpu) / rays);
  }

  // Frames: there and back again; the exactness of the last one is checked.
  const Pose home = session.state().scene.objects[object].pose;
  Pose away = home;
  away.translation.x += step;
  std::vector<double> frame, share, again;
  for (int turn = 0; turn < 8; ++turn) {
    const scene::Edit edit = scene::Move{object, turn % 2 ? home : away};
    const double cpu = cpu_seconds(), wall = wall_seconds();
    const session::Frame done = session.update({&edit, 1}, 0, progress);
    if (turn < 2) continue;  // warm up
    const double used = cpu_seconds() - cpu;
    frame.push_back(1e3 * used);
    share.push_back(stage(done, "gather", used / (wall_seconds() - wall)) / frame.back());
    again.push_back(double(done.gathered_rays) / rays);
  }
  const auto updated = session.digest();
  session.recompute(progress);
  const bool equal = session.digest() == updated;
  const gather::GatherHits& hits = session.state().rays.hits;
  std::printf(
      "{\"paths\": %zu, \"rays\": %u, \"samples\": %zu, \"raw_ray_ns\": %.1f, "
      "\"ray_over_raw\": %.2f, \"look_up_ns\": %.2f, \"bytes_per_sample\": %.1f, "
      "\"bytes_per_ray\": %.2f, \"chains\": %.3f, \"guides\": %zu, \"recompute_ms\": %.1f, "
      "\"frame_ms\": %.2f, \"frame_share\": %.3f, \"rays_again\": %.4f, \"speedup\": %.1f, "
      "\"exact\": %s}\n",
      size_t(options.paths), options.gather_rays, samples, median(raw), median(cast) / median(raw),
      median(look_up), double(hits.bytes()) / double(samples), double(hits.bytes()) / rays,
      double(hits.chains().size()) / rays, session.state().rays.guiding.guides.size(), median(full),
      median(frame), median(share), median(again), median(full) / median(frame),
      equal ? "true" : "false");
  return equal ? 0 : 1;
}
