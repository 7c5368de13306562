// SPDX-License-Identifier: Apache-2.0
// The list of paths that wait to be traced again: each path once, in the order of replacement.
#pragma once
#include <span>
#include <vector>

#include "session/paths/path_layer.h"

namespace deltalux::session {

/// Adds the paths that one edit affects to the list of waiting paths, and marks them in
/// PathLayer::cut.
///
/// Paths of the oldest edit come first. Those of one edit are ordered by their index in their
/// light's low-discrepancy sequence: consecutive points cover all directions of emission evenly, so
/// that after any share of replacements the remaining old paths are spread over the whole scene
/// (Dmitriev et al. 2002, "Interactive global illumination using selective photon tracing").
class EditMarks {
 public:
  /// Invalidates the known hits of the paths that already wait, since the scene has changed.
  explicit EditMarks(PathLayer& paths);
  /// Marks a path to be traced again from path.bounce on, unless it is already marked at that
  /// bounce or an earlier one. A path that waits for an older edit keeps its position in the list.
  void mark(const PendingPath& path);
  /// Marks all paths of a light to be traced anew from the light.
  void mark_all(const trace::Light& light);
  /// Adds the paths of lights from index `first` on to those held, as segments that are not in use
  /// yet, and marks them.
  void add_lights(size_t first);
  /// Sorts the paths of this edit, as described above.
  void order();

 private:
  PathLayer& paths_;
  // By slot of bounce 0: index in the list of the paths of older edits. Empty if there are none.
  std::vector<uint32_t> place_;
  size_t older_;
};

/// Whether the marks (PathLayer::cut) are those of the waiting paths, and of no other.
bool agree(const PathLayer& paths);

}  // namespace deltalux::session
