// SPDX-License-Identifier: Apache-2.0
// Clocks, medians, and the stages of a session's calls in CPU time.
#pragma once
#include <algorithm>
#include <ctime>
#include <vector>

#include "session/session.h"

namespace deltalux::benchmarks {

inline double cpu_seconds() {
  timespec t;
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

inline double wall_seconds() {
  timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return double(t.tv_sec) + 1e-9 * double(t.tv_nsec);
}

inline double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[values.size() / 2];
}

/// Wall-clock milliseconds of a stage, scaled to CPU time by what the whole call used of each.
inline double stage(const session::Frame& frame, const char* name, double cpu_per_wall) {
  double sum = 0;
  for (const auto& [key, ms] : frame.milliseconds)
    if (key == name) sum += ms;
  return sum * cpu_per_wall;
}

}  // namespace deltalux::benchmarks
