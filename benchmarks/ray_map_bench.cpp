// SPDX-License-Identifier: Apache-2.0
// The ray map in disc mode: a query of all discs in disc-index deposits, and an update in rebuilds.
// Median of repetitions, one thread; prints JSON. Arguments: discs, segments, share changed (%).
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include "base/random.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/ray_map/tally.h"

namespace {

using namespace deltalux;
using segments::SegmentEnd;

double seconds() {  // of the processor, which others may use too
  return double(std::clock()) / CLOCKS_PER_SEC;
}

double median(std::vector<double> v) {
  std::nth_element(v.begin(), v.begin() + long(v.size() / 2), v.end());
  return v[v.size() / 2];
}

struct Segments {
  std::vector<float> ox, oy, oz, dx, dy, dz, length;
  std::vector<uint32_t> power;

  void add(Vec3f o, Vec3f end) {
    const Vec3f d = normalize(end - o);
    ox.push_back(o.x), oy.push_back(o.y), oz.push_back(o.z);
    dx.push_back(d.x), dy.push_back(d.y), dz.push_back(d.z);
    length.push_back(deltalux::length(end - o));
    power.insert(power.end(), {1000, 900, 800});
  }
  segments::SegmentSpan span(size_t begin, size_t end) const {
    return {end - begin, &ox[begin],     &oy[begin],     &oz[begin],        &dx[begin], &dy[begin],
            &dz[begin],  &length[begin], &length[begin], &power[3 * begin], nullptr};
  }
};

Vec3f on_sphere(const PathRandom& random, uint32_t dimension) {
  const float z = 2 * random(0, dimension) - 1, phi = 6.2831853f * random(0, dimension + 1);
  const float r = std::sqrt(std::max(0.0f, 1 - z * z));
  return {r * std::cos(phi), r * std::sin(phi), z};
}

/// A point on the six walls of a room and on a table in it, with its normal.
std::pair<Vec3f, Vec3f> on_surface(const PathRandom& random, uint32_t dimension) {
  const float pick = random(0, dimension), u = random(0, dimension + 1),
              v = random(0, dimension + 2);
  if (pick < 0.1f) return {{2 + u, 2 + v, 0.8f}, {0, 0, 1}};
  const int wall = std::min(5, int((pick - 0.1f) / 0.15f)), axis = wall / 2;
  const Vec3f size{6, 5, 3};
  Vec3f p, n;
  const int a = (axis + 1) % 3, b = (axis + 2) % 3;
  p[a] = u * size[a], p[b] = v * size[b], p[axis] = wall % 2 ? size[axis] : 0;
  n[axis] = wall % 2 ? -1.0f : 1.0f;
  return {p, n};
}

// long: one measurement after another, each of a few lines.
void measure(const char* world, bool room, size_t disc_count, size_t count, double percent) {
  const size_t changed = size_t(double(count) * percent / 100);
  Segments segments;
  samples::DiscSet discs;
  for (size_t i = 0; i < count + changed; ++i) {
    const PathRandom random(1, i);
    if (room)
      segments.add(on_surface(random, 0).first, on_surface(random, 3).first + Vec3f{0, 0, 1e-3f});
    else
      segments.add(on_sphere(random, 0), on_sphere(random, 2));
  }
  for (uint32_t i = 0; i < disc_count; ++i) {
    const PathRandom random(2, i);
    auto [p, n] = on_surface(random, 0);
    if (!room) {
      n = on_sphere(random, 0);
      p = on_sphere(random, 2) * std::cbrt(random(0, 4));
    }
    discs.centre.push_back(room ? p + n * 0.002f : p);
    discs.normal.push_back(n);
    // Half the spacing, of 1e4 samples.
    discs.radius.push_back(room ? 0.06f : 0.04f);
    discs.outline.push_back(samples::kWholeDisc);
    discs.id.push_back(i);
  }
  const Workers workers(1);
  const estimate::DiscIndex index(discs, SegmentEnd::first, workers);
  const estimate::RayMapDiscs rays(discs, SegmentEnd::first);
  std::vector<int64_t> by_index(3 * disc_count), by_rays(3 * disc_count);
  estimate::Stats index_stats, ray_stats;
  std::vector<double> index_time, ray_time, rebuild_time, update_time, bytes;
  bool equal = true;
  for (int repetition = 0; repetition < 5; ++repetition) {
    std::fill(by_index.begin(), by_index.end(), 0), std::fill(by_rays.begin(), by_rays.end(), 0);
    double start = seconds();
    index_stats =
        index.accumulate(segments.span(0, count), 1, {by_index.data(), disc_count, false});
    index_time.push_back(seconds() - start);
    start = seconds();
    ray_stats = rays.accumulate(segments.span(0, count), 1, {by_rays.data(), disc_count, false});
    ray_time.push_back(seconds() - start);
    equal = equal && by_index == by_rays;

    // Rebuild: a new map of all segments that is kept, and its first query.
    start = seconds();
    estimate::RayMap map(SegmentEnd::first, {});
    map.push(segments.span(0, count));
    estimate::RayMapTally tally(discs, 1);
    tally.refresh(map, segments.power, workers);
    rebuild_time.push_back(seconds() - start);
    equal = equal && tally.sums() == by_index;
    bytes.push_back(double(map.bytes() + tally.bytes()) / double(count));

    // Update: take every so-manieth segment out of map and sums, push as many new ones, bring the
    // sums up to date.
    std::vector<uint32_t> gone;
    for (size_t i = 0; i < changed; ++i) gone.push_back(uint32_t(i * count / changed));
    start = seconds();
    map.remove(gone);
    tally.remove(gone, segments.power);
    map.push(segments.span(count, count + changed));
    tally.refresh(map, segments.power, workers);
    update_time.push_back(seconds() - start);
    for (const uint32_t i : gone)
      index.accumulate(segments.span(i, i + 1), -1, {by_index.data(), disc_count, false});
    index.accumulate(segments.span(count, count + changed), 1,
                     {by_index.data(), disc_count, false});
    equal = equal && tally.sums() == by_index;
  }
  const double n = double(count);
  std::printf(
      "{\"world\": \"%s\", \"discs\": %zu, \"segments\": %zu, \"changed_percent\": %g, "
      "\"equal\": %s,\n \"hits_per_segment\": %.3f, \"disc_tests_per_segment\": %.1f, "
      "\"halvings_per_segment\": %.1f,\n \"index_ns_per_segment\": %.1f, "
      "\"query_in_index_deposits\": %.2f, \"rebuild_in_index_deposits\": %.2f,\n "
      "\"rebuild_in_updates\": %.1f, \"bytes_per_segment\": %.0f}\n",
      world, disc_count, count, percent, equal ? "true" : "false", double(ray_stats.hits) / n,
      double(ray_stats.disc_tests) / n, double(ray_stats.node_tests) / n,
      median(index_time) * 1e9 / n, median(ray_time) / median(index_time),
      median(rebuild_time) / median(index_time), median(rebuild_time) / median(update_time),
      median(bytes));
  if (!equal || ray_stats.hits != index_stats.hits) std::exit(1);
}

}  // namespace

int main(int argc, char** argv) {
  const size_t discs = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 10000;
  const size_t segments = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 1000000;
  const double percent = argc > 3 ? std::atof(argv[3]) : 3;
  measure("lines in the unit sphere", false, discs, segments, percent);
  measure("room", true, discs, segments, percent);
}
