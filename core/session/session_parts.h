// SPDX-License-Identifier: Apache-2.0
// The discs of a session's parts, after their placement and before the choice of their methods.
#pragma once
#include <deque>

#include "plan/pilot.h"
#include "session/session.h"

namespace deltalux::session {

struct Parts {
  /// Of the static part, then of `moving`, in that order; or none.
  std::deque<plan::Pilot> pilots;
  std::vector<MovingPart> moving;  ///< as State::moving, without estimators
  std::vector<float> openness;     ///< as State::openness
};

/// Gives each present cell its sums, see State::sum_groups; new ones are 0 and count as touched.
void lay_out_cell_sums(State& s);

/// The forecast memory of `rays` gather rays, those of all samples together.
double ray_bytes(const State& s, const Forecast& forecast, double rays, bool weighted);

}  // namespace deltalux::session
