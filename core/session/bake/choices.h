// SPDX-License-Identifier: Apache-2.0
// What a bake chooses for gather rays, in a state without anything that edits may change: so an
// update, a recompute and a bake after any edits agree.
#pragma once
#include <cstddef>
#include <cstdint>
#include <vector>

#include "session/shared/path_sums.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Chooses guides, the rule for numbers of rays, and these numbers, in a state whose lights have
/// their paths. Sessions that share paths keep the state in which they chose, and leave the numbers
/// to number_rays(). Does nothing without a final gather. Throws Cancelled.
void choose_guiding(State& s, Progress& progress);
/// In a session that shares paths: how often all samples double the standard number of rays.
/// Forgets the state in which it chose. Throws Cancelled.
std::vector<int8_t> choose_all_doublings(State& s, Progress& progress);
/// In a session that shares paths: how many rays samples [first, last) cast, and the targets that
/// they see. Throws Cancelled.
RayNumbers number_rays(State& s, size_t first, size_t last, Progress& progress);

}  // namespace deltalux::session
