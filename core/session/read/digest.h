// SPDX-License-Identifier: Apache-2.0
// Digests: hashes of everything that values depend on, in the present and after any further edit.
#pragma once
#include <array>
#include <cstdint>
#include <optional>

#include "session/state/state.h"

namespace deltalux::session {

/// See Session::digest().
std::array<uint64_t, 4> digest(const State& state, const std::optional<SegmentsHash>& others);

}  // namespace deltalux::session
