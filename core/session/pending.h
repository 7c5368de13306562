// SPDX-License-Identifier: Apache-2.0
// Paths that wait to be traced again, each once, in the order in which their turn will come.
#pragma once
#include <vector>

#include "session/path_update.h"
#include "session/state.h"

namespace deltalux::session {

/// Adds the paths that one edit touches to the list of those that wait, and marks them in
/// State::cut.
///
/// The oldest edit's paths come first. Those of one edit are ordered by their place in their
/// light's low-discrepancy sequence: consecutive points cover all emission evenly, so what is left
/// after any share of them is spread over the whole scene (Dmitriev et al. 2002, "Interactive
/// global illumination using selective photon tracing").
class EditMarks {
 public:
  /// What was known of the hits of waiting paths holds no longer.
  EditMarks(State& state, std::vector<PendingPath>& waiting);
  /// Lets a path wait from path.bounce on, if it does not do so already. A path that waited for an
  /// older edit keeps its turn.
  void mark(const PendingPath& path);
  /// Puts the paths of this edit into their order.
  void order();

 private:
  State& state_;
  std::vector<PendingPath>& waiting_;
  std::vector<uint32_t> place_;  // by path, of the older ones in the list; empty if there are none
  size_t older_;
};

}  // namespace deltalux::session
