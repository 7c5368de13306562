// SPDX-License-Identifier: Apache-2.0
// How many gather rays each sample casts, as a bake chooses it.
#pragma once
#include <span>

#include "session/state/state.h"

namespace deltalux::session {

/// Casts a few rays from a few samples, to predict the memory of all rays.
gather::GatherHits::PerRay pilot_rays(const State& state);
/// Chooses the rule for numbers of rays. Returns whether anything is lit.
bool choose_need(State& state, const gather::Evaluation& now);
/// Adds the rays chosen to the forecast; drops the choice if they exceed the memory limit.
void fit_rays(State& state);
/// All of it. `seen`: the guides seen by every sample. Throws Cancelled.
void choose_rays(State& state, const gather::Evaluation& now,
                 std::span<const gather::SeenTargets> seen, Progress& progress);

}  // namespace deltalux::session
