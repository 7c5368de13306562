// SPDX-License-Identifier: Apache-2.0
// Surface gradients of irradiance.
#pragma once
#include "base/progress.h"
#include "session/shared/path_sums.h"
#include "session/state/state.h"

namespace deltalux::session {

/// What the gradients of the paths held here are made of. Throws Cancelled.
SlopeSums slope_sums(State& state, Progress& progress);
/// See Session::read_gradient().
void read_gradient(State& state, double* gradient, Progress& progress, const SlopeSums& others);

}  // namespace deltalux::session
