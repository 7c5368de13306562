// SPDX-License-Identifier: Apache-2.0
// The discs of a session's parts, between their placing and the choice of their methods.
#pragma once
#include <deque>

#include "plan/pilot.h"
#include "session/session.h"

namespace deltalux::session {

struct Parts {
  plan::Pilot still;
  std::deque<plan::Pilot> moving;  ///< like State::moving
};

/// What so many rays of all samples together are forecast to keep.
double ray_bytes(const State& s, const Forecast& forecast, double rays, bool weighted);

}  // namespace deltalux::session
