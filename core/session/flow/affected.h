// SPDX-License-Identifier: Apache-2.0
// Finds the stored segments that changed objects or materials affect: a scan, then an exact test.
#pragma once
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/state/state.h"
#include "session/world/object_change.h"

namespace deltalux::session {

/// A segment whose flight the edit changes. If `hit_known`, `hit` is its new first hit.
struct AffectedSegment {
  uint32_t slot = 0;
  bool hit_known = false;
  trace::Hit hit;
};

/// The result of find_affected().
struct Affected {
  std::vector<std::vector<AffectedSegment>> segments;  ///< by bounce
  /// By changed object, then by bounce: slots of the segments that pass the new bounds of the
  /// object and of its samples' discs.
  std::vector<std::vector<std::vector<uint32_t>>> near;
  uint64_t scanned = 0, candidates = 0;
};

/// Finds the segments that an edit affects. `changes` must already be applied to the scene and to
/// the ray caster. `materials`: 1 for each changed material; may be empty. Throws Cancelled;
/// changes no state.
Affected find_affected(const State& state, std::span<const ObjectChange> changes,
                       std::span<const uint8_t> materials, Progress& progress);

}  // namespace deltalux::session
