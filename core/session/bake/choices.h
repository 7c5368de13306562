// SPDX-License-Identifier: Apache-2.0
// What a bake chooses for gather rays, in a state without anything that edits may change: so an
// update, a recompute and a bake after any edits agree.
#pragma once
#include <cstddef>

#include "session/shared/path_sums.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Chooses guides and the rule for numbers of rays, in a state whose lights have their paths.
/// Sessions that share paths keep the state in which they chose. Does nothing without a final
/// gather. Throws Cancelled.
void choose_guiding(State& s, Progress& progress);
/// How many rays samples [first, last) cast, and the targets that they see. Throws Cancelled.
RayNumbers number_rays(State& s, size_t first, size_t last, Progress& progress);
/// Chooses the numbers of rays of all samples, as memory admits, and forgets the state in which
/// that was done. Returns the targets that samples see.
std::vector<gather::SeenTargets> choose_numbers(State& s, Progress& progress);

}  // namespace deltalux::session
