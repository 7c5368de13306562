// SPDX-License-Identifier: Apache-2.0
// The list of paths that wait to be traced again: each path once, in the order of replacement.
#pragma once
#include <span>
#include <vector>

#include "session/path_update.h"
#include "session/state.h"

namespace deltalux::session {

/// Adds the paths that one edit affects to the list of waiting paths, and marks them in State::cut.
///
/// Paths of the oldest edit come first. Those of one edit are ordered by their index in their
/// light's low-discrepancy sequence: consecutive points cover all directions of emission evenly, so
/// that after any share of replacements the remaining old paths are spread over the whole scene
/// (Dmitriev et al. 2002, "Interactive global illumination using selective photon tracing").
class EditMarks {
 public:
  /// Invalidates the known hits of the paths that already wait, since the scene has changed.
  EditMarks(State& state, std::vector<PendingPath>& waiting);
  /// Marks a path to be traced again from path.bounce on, unless it is already marked at that
  /// bounce or an earlier one. A path that waits for an older edit keeps its position in the list.
  void mark(const PendingPath& path);
  /// Sorts the paths of this edit, as described above.
  void order();

 private:
  State& state_;
  std::vector<PendingPath>& waiting_;
  // By slot of bounce 0: index in the list of the paths of older edits. Empty if there are none.
  std::vector<uint32_t> place_;
  size_t older_;
};

/// Whether the marks (State::cut) are those of the waiting paths, and of no other.
bool agree(std::span<const uint16_t> cut, const HeldPaths& held,
           std::span<const PendingPath> waiting);

}  // namespace deltalux::session
