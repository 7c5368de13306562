// SPDX-License-Identifier: Apache-2.0
// What a bake, a recompute or an update reports of its work.
#pragma once
#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "base/stopwatch.h"

namespace deltalux::session {

struct Frame {
  uint64_t affected_paths = 0, removed_segments = 0, retraced_segments = 0;
  uint64_t scanned_segments = 0, candidates = 0;
  /// Gather rays that were cast, and of those of an update, how many brought something else than
  /// before.
  uint64_t gathered_rays = 0, changed_rays = 0;
  /// The smallest of three shares: of pending paths replaced, of direct light and of gather rays
  /// that are up to date.
  double done = 1;
  std::vector<std::pair<std::string, double>> milliseconds;  ///< by stage, wall clock

  /// Records the time since the last stage under `name`.
  void end_stage(const char* name, Stopwatch& watch) {
    milliseconds.emplace_back(name, watch.lap());
  }
};

}  // namespace deltalux::session
