// SPDX-License-Identifier: Apache-2.0
// Cuts paths at their first changed segment and traces them again from there, keeping the sums
// equal to the stored segments at every step.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/deposit.h"
#include "session/landings.h"
#include "session/state.h"

namespace deltalux::session {

/// A path to trace again from `bounce` = state.cut[path]; its segment there is in `slot`.
struct PendingPath {
  uint32_t path = 0;
  uint32_t slot = 0;
  uint8_t bounce = 0;
  bool hit_known = false;  ///< `hit` is what its segment meets now; holds until the next edit
  trace::Hit hit;
};

struct PathCounts {
  uint64_t paths = 0, removed = 0, retraced = 0;
  double remove_ms = 0, trace_ms = 0, deposit_ms = 0, moving_ms = 0;
};

class PathUpdate {
 public:
  explicit PathUpdate(State& state);

  /// Traces new paths; their slots at bounce 0, of the same numbers, are allocated. Throws
  /// Cancelled in the middle: the state is of no use then.
  void start(std::span<const uint32_t> paths, const Progress& progress);
  /// Replaces the given pending paths. `between` runs after the old segments went and before the
  /// new ones come.
  void replace(std::span<const PendingPath> pending, const std::function<void()>& between);

  const PathCounts& counts() const { return counts_; }

 private:
  /// What to trace at one bounce, and what is known of it (the first `hits`.size() slots).
  struct Wavefront {
    std::vector<uint32_t> slots;
    std::vector<trace::Hit> hits;
  };
  /// Looks at `progress`, if any, between the bounces.
  void advance(std::vector<Wavefront> fresh, const Progress* progress);
  void trace(uint32_t bounce, const Wavefront& wavefront, std::vector<uint32_t>& children);
  void write_birth(segments::Segment& segment, const trace::Light& light, uint64_t index) const;

  State& state_;
  trace::Walk walk_;
  Deposit deposit_;
  Landings landings_;
  std::vector<std::array<uint32_t, 3>> quanta_;  // per light
  PathCounts counts_;
};

}  // namespace deltalux::session
