// SPDX-License-Identifier: Apache-2.0
// Traces all paths of a state, and adds what they bring to its sums.
#pragma once
#include "base/progress.h"
#include "session/state/frame.h"
#include "session/state/state.h"

namespace deltalux::session {

/// In a state whose lights have their paths, and whose surfaces are divided. Throws Cancelled.
void trace_all(State& state, Progress& progress, Frame& frame);

}  // namespace deltalux::session
