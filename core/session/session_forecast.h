// SPDX-License-Identifier: Apache-2.0
// The memory of gather rays, and the layout of what cells sum up.
#pragma once
#include "session/session.h"

namespace deltalux::session {

/// Gives each present cell its sums, see World::sum_groups; new ones are 0 and count as touched.
void lay_out_cell_sums(State& s);

/// The forecast memory of `rays` gather rays, those of all samples together.
double ray_bytes(const State& s, const Forecast& forecast, double rays, bool weighted);

}  // namespace deltalux::session
