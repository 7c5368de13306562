// SPDX-License-Identifier: Apache-2.0
// Applies edits, and replaces what they affect: paths, direct light, gather rays and areas.
#pragma once
#include <functional>
#include <span>

#include "base/progress.h"
#include "base/stopwatch.h"
#include "scene/edit.h"
#include "session/flow/affected.h"
#include "session/flow/edit_log.h"
#include "session/state/frame.h"
#include "session/state/state.h"

namespace deltalux::session {

class Update {
 public:
  /// `edits` have passed check(). With `budget_ms` > 0, the work stops after about that time.
  Update(State& state, std::span<const scene::Edit> edits, double budget_ms, Progress& progress);
  /// Applies the edits and finds what they affect. After edits that change Scene::world() calls
  /// renew() instead, which computes everything again in another state: each segment that leaves
  /// the scene ends on its border, and what finds segments counts in shares of it. If this throws,
  /// everything is as before.
  void apply(const std::function<Frame()>& renew);
  /// Whether renew() was called; this object's state is gone then.
  bool renewed() const { return log_.changes_world(); }
  /// Brings paths, gather rays and areas up to date with the edits applied. Returns the number of
  /// paths that wait because the memory limit does not admit them. If it throws, only a
  /// recomputation gives a valid state again.
  size_t follow();
  /// Ends the measurement of time.
  Frame end();

 private:
  /// Throws OptionError if brighter surfaces would make paths so long that they exceed the memory
  /// limit.
  void refuse_growth();
  /// Marks the paths that the edits affect, and replaces them and those that waited before.
  size_t replace_paths(double budget_ms);
  /// Replaces waiting paths within the time budget.
  size_t run_pending(double budget_ms, const std::function<void()>& between);
  /// Casts again the gather rays that the edits may have changed.
  void gather_again();

  State& s_;
  std::span<const scene::Edit> edits_;
  double budget_ms_;
  Progress& progress_;
  Stopwatch watch_;
  EditLog log_;
  Affected affected_;
  Frame frame_;
};

}  // namespace deltalux::session
