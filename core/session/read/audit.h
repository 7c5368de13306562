// SPDX-License-Identifier: Apache-2.0
// The energy balance of stored paths.
#pragma once
#include <array>

#include "session/state/state.h"

namespace deltalux::session {

/// Energy balance per channel, in quanta, of the paths held: emitted = absorbed + escaped.
/// `quantum` is in the scene's unit of power.
struct EnergyAudit {
  __extension__ using Quanta = std::array<__int128, 3>;
  Quanta emitted{}, absorbed{}, escaped{};
  double quantum = 0;
};

EnergyAudit audit(const State& state);

}  // namespace deltalux::session
