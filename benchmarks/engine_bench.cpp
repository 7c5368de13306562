// SPDX-License-Identifier: Apache-2.0
// The engine on a real scene, every figure a ratio of CPU times within this process:
//   engine_bench DUMP PATHS THREADS STEP -> one JSON object on stdout
// STEP: how far the movable goes, metres.
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>

#include "base/direction.h"
#include "raw_rays.h"
#include "scene_dump.h"
#include "session/paths/scan.h"
#include "session/session.h"
#include "timing.h"

using namespace deltalux;
using namespace deltalux::benchmarks;

namespace {

/// Every `stride`-th stored segment, in storage order: as incoherent as the tracer's own rays.
Rays stored_rays(const session::State& state, size_t stride) {
  Rays rays;
  size_t k = 0;
  for (const segments::BounceSegments& stored : state.paths.store.bounces())
    for (uint32_t slot = 0; slot < stored.size(); ++slot)
      if (stored.at(slot).length >= 0 && k++ % stride == 0) {
        rays.origin.push_back(stored.at(slot).origin);
        rays.direction.push_back(decode_direction(stored.at(slot).direction));
      }
  return rays;
}

}  // namespace

// long: one measurement after another, each of a few lines.
int main(int argc, char** argv) {
  if (argc != 5) {
    std::fprintf(stderr, "usage: engine_bench DUMP PATHS THREADS STEP\n");
    return 2;
  }
  Dump dump = read_dump(argv[1]);
  session::Options options;
  options.paths = std::strtoull(argv[2], nullptr, 10);
  options.threads = std::atoi(argv[3]);
  options.direct = session::DirectMode::paths;
  const double step = std::atof(argv[4]);
  const size_t samples = dump.samples.size();
  const uint32_t object = first_movable(dump.scene);
  session::Session session(std::move(dump.scene), std::move(dump.samples), options);
  Progress progress;
  const double bake_start = cpu_seconds();
  session.bake(progress);
  const double bake = cpu_seconds() - bake_start;
  const double segments = double(session.state().paths.store.live());

  // Tracing and depositing of a whole recompute, beside raw rays, in turn.
  const Rays rays = stored_rays(session.state(), 4);
  std::vector<double> raw, trace, deposit, full, full_wall;
  for (int turn = 0; turn < 3; ++turn) {
    raw.push_back(raw_ray_ns(*session.state().caster, rays));
    const double cpu = cpu_seconds(), wall = wall_seconds();
    const session::Frame done = session.recompute(progress);
    full.push_back(1e3 * (cpu_seconds() - cpu));
    full_wall.push_back(1e3 * (wall_seconds() - wall));
    const double share = full.back() / full_wall.back();
    trace.push_back(1e6 * stage(done, "trace", share) / segments);
    deposit.push_back(1e6 * stage(done, "deposit", share) / segments);
  }
  const double raw_ns = median(raw);

  // The scan alone, over all outlines, for the box of the movable.
  const session::ScanBox box = session::scan_box(session.state().paths.store.grid(),
                                                 session.state().caster->object_bounds(object));
  std::vector<double> scan;
  std::vector<uint32_t> candidates;
  for (int turn = 0; turn < 15; ++turn) {
    const double start = cpu_seconds();
    candidates.clear();
    for (const segments::BounceSegments& stored : session.state().paths.store.bounces())
      for (uint32_t slot = 0; slot < stored.size(); slot += segments::BounceSegments::kChunk) {
        const segments::BounceSegments::Chunk& chunk = stored.chunk(slot);
        session::scan(chunk.low, chunk.high, segments::BounceSegments::kChunk, {&box, 1}, slot,
                      candidates);
      }
    scan.push_back(1e9 * (cpu_seconds() - start) / segments);
  }

  // Frames: there and back again; the exactness of the last one is checked.
  const Pose home = session.state().scene.objects[object].pose;
  Pose away = home;
  away.translation.x += step;
  std::vector<double> frame, frame_wall, search, moving, traced, removed, affected;
  std::map<std::string, std::vector<double>> stages;
  uint64_t candidates_seen = 0;
  for (int turn = 0; turn < 24; ++turn) {
    const scene::Edit edit = scene::Move{object, turn % 2 ? home : away};
    const double cpu = cpu_seconds(), wall = wall_seconds();
    const session::Frame done = session.update({&edit, 1}, 0, progress);
    if (turn < 4) continue;  // warm up
    frame.push_back(1e3 * (cpu_seconds() - cpu));
    frame_wall.push_back(1e3 * (wall_seconds() - wall));
    const double share = frame.back() / frame_wall.back();
    search.push_back(1e6 * stage(done, "scan", share) / segments);
    moving.push_back(stage(done, "moving samples", share) / frame.back());
    traced.push_back(double(done.retraced_segments));
    removed.push_back(double(done.removed_segments));
    affected.push_back(double(done.affected_paths));
    candidates_seen = done.candidates;
    for (const auto& [key, ms] : done.milliseconds) stages[key].push_back(ms * share);
  }
  const auto updated = session.digest();
  session.recompute(progress);
  const bool equal = session.digest() == updated;

  // Hits of an average segment, for the frame's lower bound.
  int64_t sum = 0;
  std::vector<int64_t> sums(3 * samples);
  session.read_sums(sums.data());
  for (int64_t v : sums) sum += v;
  double power = 0;
  for (const segments::BounceSegments& stored : session.state().paths.store.bounces())
    for (uint32_t slot = 0; slot < stored.size(); ++slot)
      if (stored.at(slot).length >= 0)
        for (uint32_t p : stored.at(slot).power) power += p;
  const double hits = double(sum) / power;
  const double least_ms =
      1e-6 * (median(traced) * raw_ns + (median(traced) + median(removed)) * hits * 5.0);

  std::printf(
      "{\"paths\": %zu, \"threads\": %d, \"samples\": %zu, \"segments\": %.0f, \"triangles\": %u, "
      "\"bake_seconds\": %.3f, \"raw_ray_ns\": %.1f, \"raw_over_trace\": %.3f, "
      "\"deposit_over_raw\": %.3f, \"hits_per_segment\": %.3f, \"scan_ns\": %.3f, "
      "\"search_ns\": %.3f, \"recompute_ms\": %.2f, \"recompute_wall_ms\": %.2f, "
      "\"frame_ms\": %.3f, \"frame_wall_ms\": %.3f, \"speedup\": %.1f, \"speedup_wall\": %.1f, "
      "\"frame_efficiency\": %.3f, \"moving_share\": %.3f, \"affected_paths\": %.0f, "
      "\"candidates\": %llu, "
      "\"bytes_per_segment\": %.2f, \"exact\": %s, \"stages_ms\": {",
      size_t(options.paths), session.state().workers.threads(), samples, segments,
      session.state().scene.primitives(), bake, raw_ns, raw_ns / median(trace),
      median(deposit) / raw_ns, hits, median(scan), median(search), median(full), median(full_wall),
      median(frame), median(frame_wall), median(full) / median(frame),
      median(full_wall) / median(frame_wall), least_ms / median(frame), median(moving),
      median(affected), static_cast<unsigned long long>(candidates_seen),
      double(session.state().paths.store.bytes() + session.state().paths.cut.size()) / segments,
      equal ? "true" : "false");
  const char* comma = "";
  for (const auto& [key, values] : stages) {
    std::printf("%s\"%s\": %.3f", comma, key.c_str(), median(values));
    comma = ", ";
  }
  std::puts("}}");
  return equal ? 0 : 1;
}
