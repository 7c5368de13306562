// SPDX-License-Identifier: Apache-2.0
// Cuts paths at their first changed segment and traces them again from there; keeps the sums equal
// to the stored segments at every step.
#pragma once
#include <functional>
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/discs/deposit.h"
#include "session/flow/landings.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Statistics of all calls: numbers of paths and segments, milliseconds by stage.
struct PathCounts {
  uint64_t paths = 0, removed = 0, retraced = 0;
  double remove_ms = 0, trace_ms = 0, deposit_ms = 0, moving_ms = 0;
};

class PathUpdate {
 public:
  explicit PathUpdate(State& state);

  /// Traces the held paths of these slots of bounce 0, which must be allocated. Throws Cancelled in
  /// the middle; the state is then useless.
  void start(std::span<const uint32_t> slots, const Progress& progress);
  /// Replaces the given pending paths. Calls `between` after all old segments are removed and
  /// before new ones are added.
  void replace(std::span<const PendingPath> pending, const std::function<void()>& between);

  const PathCounts& counts() const { return counts_; }

 private:
  /// The segments to trace at one bounce; the first hits.size() of them have known hits.
  struct Wavefront {
    std::vector<uint32_t> slots;
    std::vector<trace::Hit> hits;
  };
  /// Traces bounce by bounce, from `fresh`, the segments that begin anew at each bounce. Checks
  /// `progress`, if not null, between bounces.
  void advance(std::vector<Wavefront> fresh, const Progress* progress);
  /// Traces the segments of one bounce; returns the slots of the segments that follow in
  /// `children`.
  void trace(uint32_t bounce, const Wavefront& wavefront, std::vector<uint32_t>& children);
  /// Stores where a segment ends.
  void write(uint32_t bounce, uint32_t slot, const trace::Interaction& interaction);
  /// Writes the first segment of path `index` of the light, or marks it as unused if the light is
  /// off.
  void write_birth(segments::Segment& segment, const trace::Light& light, uint64_t index) const;

  State& state_;
  trace::Walk walk_;
  Deposit deposit_;
  Landings landings_;
  std::vector<Vec3d> quanta_;  // of power that each path of a light starts with
  PathCounts counts_;
};

}  // namespace deltalux::session
