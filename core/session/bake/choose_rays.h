// SPDX-License-Identifier: Apache-2.0
// How many gather rays each sample casts, as a bake chooses it.
#pragma once
#include <cstdint>
#include <vector>

#include "session/state/state.h"

namespace deltalux::session {

/// Casts a few rays from a few samples, to predict the memory of all rays.
gather::GatherHits::PerRay pilot_rays(const State& state);
/// Chooses the rule for numbers of rays, in a choice_state() with guides.
void choose_need(State& c, const gather::Evaluation& now);
/// By sample from `first` to `last` of a choice_state() with that rule: how often it doubles the
/// standard number of rays. Throws Cancelled.
std::vector<int8_t> choose_doublings(const State& c, size_t first, size_t last,
                                     const gather::Evaluation& now, Progress& progress);
/// Adds the rays chosen to the forecast; drops the choice if they exceed the memory limit.
void fit_rays(State& s);

}  // namespace deltalux::session
