// SPDX-License-Identifier: Apache-2.0
// Cost of the sphere cache: the lanes of its inner loops against plain code on the same work, its
// containments and orders, and the disc index on the same segments. One thread, CPU time, medians
// of interleaved repetitions. Prints JSON.
// Usage: sphere_cache_bench [segments [samples]]   (default 300000 20000)
#include <time.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <functional>
#include <numbers>
#include <string>
#include <vector>

#include "base/random.h"
#include "estimate/disc_index/disc_index.h"
#include "estimate/sphere_cache/sphere_cache.h"

using namespace deltalux;

namespace {

using estimate::Containment;
using estimate::SphereCacheOptions;
using estimate::sphere_cache::Lanes;

double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

Vec3f on_sphere(float a, float b) {
  const float z = 2 * a - 1, phi = 2 * std::numbers::pi_v<float> * b;
  const float flat = std::sqrt(std::max(0.0f, 1 - z * z));
  return {flat * std::cos(phi), flat * std::sin(phi), z};
}

struct Segments {
  std::vector<float> column[7];
  std::vector<uint32_t> power;
  segments::SegmentSpan span(size_t first, size_t count) const {
    const auto at = [&](int k) { return column[k].data() + first; };
    return {count,  at(0), at(1), at(2), at(3),
            at(4),  at(5), at(6), at(6), power.data() + 3 * first,
            nullptr};
  }
};

/// Chords of the unit sphere (paper 4.2).
Segments uniform_lines(size_t count) {
  Segments s;
  for (size_t i = 0; i < count; ++i) {
    const PathRandom random(1, i);
    const Vec3f a = on_sphere(random(0, 0), random(0, 1)),
                b = on_sphere(random(0, 2), random(0, 3));
    const float far = std::max(1e-6f, length(b - a));
    const Vec3f w = normalize(b - a);
    for (int axis = 0; axis < 3; ++axis) {
      s.column[axis].push_back(a[axis]);
      s.column[axis + 3].push_back(w[axis]);
    }
    s.column[6].push_back(far);
    s.power.insert(s.power.end(), {1, 1, 1});
  }
  return s;
}

/// Discs in the ball, as far apart as their radius is long (paper 3.1).
samples::DiscSet scatter_discs(size_t count) {
  samples::DiscSet discs;
  for (uint32_t i = 0; i < count; ++i) {
    const PathRandom random(2, i);
    discs.centre.push_back(on_sphere(random(0, 0), random(0, 1)) * std::cbrt(random(0, 2)));
    discs.normal.push_back(on_sphere(random(0, 3), random(0, 4)));
    discs.radius.push_back(2 / std::sqrt(3.0f) / std::cbrt(float(count)));
    discs.outline.push_back(samples::kWholeDisc);
    discs.id.push_back(i);
  }
  return discs;
}

struct Case {
  std::string name;
  std::function<estimate::Stats()> work;
  estimate::Stats stats{};
  std::vector<double> seconds{};
  double median() const {
    std::vector<double> v = seconds;
    std::nth_element(v.begin(), v.begin() + long(v.size() / 2), v.end());
    return v[v.size() / 2];
  }
};

}  // namespace

int main(int argc, char** argv) {
  const size_t count = argc > 1 ? std::strtoull(argv[1], nullptr, 10) : 300000;
  const size_t disc_count = argc > 2 ? std::strtoull(argv[2], nullptr, 10) : 20000;
  const Segments lines = uniform_lines(count);
  const samples::DiscSet discs = scatter_discs(disc_count);
  std::vector<int64_t> sums(3 * disc_count);
  const estimate::EnergySums target{sums.data(), disc_count, false};

  std::vector<Case> cases;
  const auto add = [&](std::string name, auto&& change, size_t span = 0) {
    SphereCacheOptions options;
    options.outer_radius = 1;
    change(options);
    auto cache = std::make_shared<estimate::SphereCache>(discs, options);
    const size_t step = span ? span : count;
    cases.push_back({std::move(name), [=, &lines] {
                       estimate::Stats stats;
                       for (size_t first = 0; first < count; first += step)
                         stats += cache->accumulate(
                             lines.span(first, std::min(step, count - first)), 1, target);
                       return stats;
                     }});
  };
  add("one lane", [](SphereCacheOptions& o) { o.lanes = Lanes::one; });
  add("eight lanes", [](SphereCacheOptions& o) { o.lanes = Lanes::eight; });
  add("widest", [](SphereCacheOptions&) {});
  add("nested", [](SphereCacheOptions& o) { o.containment = Containment::nested; });
  add("literal (lossy)", [](SphereCacheOptions& o) { o.containment = Containment::literal; });
  add("Lebesgue order", [](SphereCacheOptions& o) { o.order = Curve::lebesgue; });
  add("no order", [](SphereCacheOptions& o) { o.order = Curve::none; });
  add("ratio 0.5", [](SphereCacheOptions& o) { o.ratio = 0.5; });
  add("ratio 0.6", [](SphereCacheOptions& o) { o.ratio = 0.6; });
  add("ratio 0.9", [](SphereCacheOptions& o) { o.ratio = 0.9; });
  add("spans of 65536", [](SphereCacheOptions&) {}, 65536);
  const Workers workers(1);
  const auto index =
      std::make_shared<estimate::DiscIndex>(discs, segments::SegmentEnd::bounded, workers);
  cases.push_back(
      {"disc index", [&, index] { return index->accumulate(lines.span(0, count), 1, target); }});

  for (int repetition = 0; repetition < 3; ++repetition)
    for (Case& c : cases) {
      const double start = cpu_seconds();
      c.stats = c.work();
      c.seconds.push_back(cpu_seconds() - start);
    }
  std::printf("{\"segments\": %zu, \"samples\": %zu, \"results\": [\n", count, disc_count);
  for (const Case& c : cases) {
    const double tests = double(c.stats.sphere_tests + c.stats.disc_tests);
    std::printf(
        "  {\"name\": \"%s\", \"seconds\": %.4f, \"sphere_tests\": %.4e, \"disc_tests\": %.4e, "
        "\"hits\": %zu, \"ns_per_test\": %.3f, \"one_lane_over_this\": %.2f}%s\n",
        c.name.c_str(), c.median(), double(c.stats.sphere_tests), double(c.stats.disc_tests),
        size_t(c.stats.hits), 1e9 * c.median() / tests, cases[0].median() / c.median(),
        &c == &cases.back() ? "" : ",");
  }
  std::printf("]}\n");
}
