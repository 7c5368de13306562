// SPDX-License-Identifier: Apache-2.0
// What gather rays aim at, as a bake finds it in the light of the cells.
#pragma once
#include <cstdint>
#include <vector>

#include "session/shared/path_sums.h"
#include "session/state/state.h"

namespace deltalux::session {

/// The lights that choose_guides() may choose, since they are narrow or parallel.
std::vector<uint32_t> guide_candidates(const State& state);
/// Chooses beams, suns and guides; returns the light of all cells, without the direct light of
/// beams and suns. `others`: first flights of paths that other sessions hold. Throws Cancelled.
gather::Evaluation choose_guides(State& state, const FirstFlights& others, Progress& progress);

}  // namespace deltalux::session
