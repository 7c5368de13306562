// SPDX-License-Identifier: Apache-2.0
// Which narrow spots light so small a place that it wants rays of its own.
#pragma once
#include "gather/votes.h"

namespace deltalux::gather {

/// Spots whose light is bright to most who see where it lands. `votes` of cells that hold all
/// light.
std::vector<BeamGuide> find_beams(const Present& present, const Evaluation& evaluation,
                                  const Votes& votes, uint64_t seed);

}  // namespace deltalux::gather
