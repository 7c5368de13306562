// SPDX-License-Identifier: Apache-2.0
// The state in which a bake chooses what no edit may change: static geometry alone, in the full
// light of the lamps as they were loaded.
#pragma once
#include <cstdint>
#include <memory>
#include <vector>

#include "session/state/state.h"

namespace deltalux::session {

/// The number of paths by which a bake chooses, at most: with more, guides do not get better.
inline constexpr uint64_t kMostChoicePaths = uint64_t(1) << 20;

/// The samples that no edit moves, ascending.
std::vector<uint32_t> fixed_samples(const World& world);
/// Traces the lamps' paths, kMostChoicePaths at most, in the static scene of `s`, which has its
/// path shares and its scales of direct light. The samples are the fixed_samples() of `s`. The
/// result depends on nothing that edits change. Throws Cancelled.
std::unique_ptr<State> choice_state(const State& s, Progress& progress);

}  // namespace deltalux::session
