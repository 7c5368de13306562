// SPDX-License-Identifier: Apache-2.0
// Forecasts the memory of a bake, and refuses it beyond the limit.
#pragma once
#include "session/paths/pilot_paths.h"
#include "session/state/state.h"

namespace deltalux::session {

/// The forecast of paths and samples alone.
void forecast_memory(State& state, const PilotPaths& paths);
/// Adds direct light and gather rays to the forecast. Throws OptionError if it exceeds the memory
/// limit.
void refuse_beyond_limit(State& state);
/// Whether so many gather rays fit into the memory limit; if so, adds them to the forecast.
bool fits(State& state, const gather::RayCounts& rays);
/// The forecast memory of `rays` gather rays, those of all samples together.
double ray_bytes(const State& state, double rays, bool weighted);

}  // namespace deltalux::session
