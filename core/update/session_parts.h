// SPDX-License-Identifier: Apache-2.0
// The discs of a session's parts, between their placing and the choice of their methods.
#pragma once
#include <deque>

#include "plan/pilot.h"

namespace deltalux::update {

struct Parts {
  plan::Pilot still;
  std::deque<plan::Pilot> moving;  ///< like State::moving
};

}  // namespace deltalux::update
