// SPDX-License-Identifier: Apache-2.0
// Which edits a state admits.
#pragma once
#include <span>

#include "scene/edit.h"
#include "session/state/state.h"

namespace deltalux::session {

/// Throws OptionError or SceneError if `edit` cannot be applied after the edits `before` it, none
/// of which has been applied yet.
void check(const State& state, const scene::Edit& edit, std::span<const scene::Edit> before);

}  // namespace deltalux::session
