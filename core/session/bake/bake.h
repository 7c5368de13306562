// SPDX-License-Identifier: Apache-2.0
// Computes all sums of a scene from scratch.
#pragma once
#include "session/state/frame.h"
#include "session/state/state.h"

namespace deltalux::session {

// All throw Cancelled; the state is then useless.

/// Computes everything in a fresh state: acceleration structures, discs if any count, paths, direct
/// light, gather rays. Throws OptionError before tracing if the memory limit would be exceeded.
/// `leave_direct`: see Session::bake().
Frame bake(State& state, Progress& progress, bool leave_direct);
/// The same in a fresh state that took over the choices of another, which it keeps.
Frame recompute(State& state, Progress& progress);
/// Predicts the cost of every method for each part, see Session::plan().
const std::vector<plan::PartPlan>& plan_parts(State& state, Progress& progress);
/// Recomputes all paths and sums after an update that failed in the middle. Cannot be cancelled; if
/// it throws, the state remains damaged.
void rebuild(State& state, Progress& progress);

/// Casts the gather rays of all samples, towards the guides of the bake. `new_numbers`: whether
/// their numbers were just chosen, so that they have to fit into memory. In a session with a part
/// of the paths, or without a final gather, this does nothing.
void gather_light(State& state, Progress& progress, bool new_numbers = false);

}  // namespace deltalux::session
