// SPDX-License-Identifier: Apache-2.0
// What gather rays aim at, as a bake finds it in the light of the cells.
#pragma once
#include "session/state/state.h"

namespace deltalux::session {

/// Chooses beams, suns and guides in a choice_state(); returns the light of all cells, without the
/// direct light of beams and suns. Throws Cancelled.
gather::Evaluation choose_guides(State& c, Progress& progress);

}  // namespace deltalux::session
