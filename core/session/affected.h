// SPDX-License-Identifier: Apache-2.0
// Which stored segments does a change of objects or materials touch? Scan, then exact test.
#pragma once
#include <span>
#include <vector>

#include "base/progress.h"
#include "session/state.h"

namespace deltalux::session {

/// One object's change: where it was and where it is (empty boxes: absent).
struct ObjectChange {
  uint32_t object = scene::kNone;
  Box before, after;
};

std::vector<Box> boxes_of(std::span<const ObjectChange> changes);
/// Numbers of the samples that lie on changed objects.
std::vector<uint32_t> moved_samples(const State& state, std::span<const ObjectChange> changes);

/// A segment whose flight changes. Where the search met the new first hit, `hit` is it.
struct AffectedSegment {
  uint32_t slot = 0;
  bool hit_known = false;
  trace::Hit hit;
};

struct Affected {
  std::vector<std::vector<AffectedSegment>> segments;  ///< per bounce
  /// Per changed object, per bounce: slots of segments that meet its part's new box.
  std::vector<std::vector<std::vector<uint32_t>>> near;
  uint64_t scanned = 0, candidates = 0;
};

/// `changes` are already in place in the scene and the caster. `materials`: 1 per changed
/// material, may be empty. Throws Cancelled; changes nothing.
Affected find_affected(const State& state, std::span<const ObjectChange> changes,
                       std::span<const uint8_t> materials, Progress& progress);

}  // namespace deltalux::session
