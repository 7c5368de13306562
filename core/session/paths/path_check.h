// SPDX-License-Identifier: Apache-2.0
// Checks whether the paths of a session file can be those of a session. All functions throw
// FormatError.
#pragma once
#include <span>
#include <vector>

#include "session/paths/path_layer.h"

namespace deltalux::session::snapshot {

/// Checks that bounce 0 has one slot per path, and later bounces no more than that.
void check_level_sizes(std::span<const uint64_t> sizes, uint64_t paths, uint32_t max_bounces);

/// Checks one segment in use: its numbers are finite, it lies near the world box, and all its
/// indices exist.
class SegmentCheck {
 public:
  SegmentCheck(const scene::Scene& scene, uint64_t paths, size_t discs);
  void operator()(const segments::Segment& segment, float reach, const segments::HitSlots& hits,
                  uint32_t bounce) const;

 private:
  Box around_;
  float longest_;
  uint64_t paths_;
  uint32_t primitives_;
  size_t discs_;
};

/// Checks that every path is one chain: at bounce 0, each slot belongs to the path that is held
/// there, and every later segment in use has exactly one predecessor, of the same path.
void check_chains(const segments::SegmentStore& store, const HeldPaths& held);

/// Checks that each path marked in `cut` waits exactly once, at its own segment of that bounce, and
/// no other path waits.
void check_pending(const std::vector<PendingPath>& pending, const std::vector<uint16_t>& cut,
                   const segments::SegmentStore& store, const HeldPaths& held);

}  // namespace deltalux::session::snapshot
