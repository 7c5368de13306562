// SPDX-License-Identifier: Apache-2.0
// Saves a session's state as named arrays and restores it. The caller keeps scene, samples and
// options, and makes a fresh session from them; restore() adds what baking and editing made of it.
#pragma once
#include "base/archive.h"
#include "base/progress.h"
#include "session/state/state.h"

namespace deltalux::session {

// Both archives are valid until the state changes.

/// See Session::save() and save_choices().
ArchiveView save(const State& state, bool shared);
ArchiveView save_choices(const State& state);
/// See Session::restore().
void restore(State& state, ArchiveSource& archive, Progress& progress);

}  // namespace deltalux::session
