// SPDX-License-Identifier: Apache-2.0
// Times of all disc methods on segments and discs of a file, building and searching apart: one
// thread, processor time, interleaved repetitions. Prints JSON.
// Usage: method_times FILE REPETITIONS METHOD…
#include <time.h>

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <memory>
#include <string>
#include <vector>

#include "estimate/estimator.h"
#include "plan/methods.h"

using namespace deltalux;

namespace {

double thread_seconds() {
  timespec t;
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

/// As benchmarks/planner_regret.py writes it: counts, then single-precision columns.
struct Input {
  std::vector<float> column[8];
  std::vector<uint32_t> power;
  samples::DiscSet discs;

  explicit Input(const char* path) {
    std::ifstream file(path, std::ios::binary);
    uint64_t counts[2] = {};
    file.read(reinterpret_cast<char*>(counts), sizeof counts);
    const auto read = [&](auto& values, size_t count) {
      values.resize(count);
      file.read(reinterpret_cast<char*>(values.data()), std::streamsize(count * sizeof values[0]));
    };
    for (auto& values : column) read(values, counts[0]);
    read(discs.centre, counts[1]);
    read(discs.normal, counts[1]);
    read(discs.radius, counts[1]);
    if (!file) {
      std::fprintf(stderr, "method_times: %s: found a file that ends early\n", path);
      std::exit(1);
    }
    power.assign(3 * counts[0], 1);
    discs.outline.assign(counts[1], samples::kWholeDisc);
    for (uint32_t i = 0; i < counts[1]; ++i) discs.id.push_back(i);
  }
  segments::SegmentSpan span(size_t first, size_t count) const {
    const auto at = [&](int k) { return column[k].data() + first; };
    return {count, at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7), power.data(), nullptr};
  }
};

plan::Method method_of(const std::string& name) {
  return name == "brute_force"  ? plan::Method::brute_force
         : name == "ray_map"    ? plan::Method::ray_map
         : name == "disc_index" ? plan::Method::disc_index
                                : plan::Method::sphere_cache;
}

struct Times {
  std::string name;
  std::vector<double> build{}, search{};
};

void print(const char* label, const std::vector<double>& seconds) {
  std::printf("\"%s\": [", label);
  for (size_t i = 0; i < seconds.size(); ++i) std::printf("%s%.7f", i ? ", " : "", seconds[i]);
  std::printf("]");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 4) {
    std::fprintf(stderr, "usage: method_times FILE REPETITIONS METHOD...\n");
    return 2;
  }
  const Input input(argv[1]);
  const size_t count = input.column[0].size();
  std::vector<Times> all;
  for (int i = 3; i < argc; ++i) all.push_back({argv[i]});
  std::vector<int64_t> sums(3 * input.discs.size());
  const estimate::EnergySums target{sums.data(), input.discs.size(), false};
  const Workers one(1);
  for (int repetition = 0; repetition < std::atoi(argv[2]); ++repetition)
    for (Times& times : all) {
      samples::DiscSet discs = input.discs;
      const double start = thread_seconds();
      const auto estimator = plan::make_estimator(method_of(times.name), std::move(discs),
                                                  segments::SegmentEnd::first, one, nullptr);
      const double built = thread_seconds();
      // Portions as a session makes them for the methods that take few; the others get all.
      const size_t span = estimator->best_span() > 256 ? count : 256;
      for (size_t first = 0; first < count; first += span)
        estimator->accumulate(input.span(first, std::min(span, count - first)), 1, target);
      times.build.push_back(built - start);
      times.search.push_back(thread_seconds() - built);
    }
  std::printf("{");
  for (const Times& times : all) {
    std::printf("%s\"%s\": {", &times == all.data() ? "" : ", ", times.name.c_str());
    print("build", times.build);
    std::printf(", ");
    print("search", times.search);
    std::printf("}");
  }
  std::printf("}\n");
}
