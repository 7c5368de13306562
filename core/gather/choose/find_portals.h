// SPDX-License-Identifier: Apache-2.0
// Finds openings through which samples see far brighter places, such as a hole in the wall to a lit
// room: few rays pass, and each of them brings more light than all others.
#pragma once
#include <span>
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "gather/aim/guide.h"
#include "gather/hits/chain.h"
#include "gather/hits/evaluate.h"

namespace deltalux::gather {

/// Returns guides in the planes of openings: where many sight lines from samples to bright places
/// come close together. `known`: guides whose places need no others. Like all guides, they affect
/// noise only.
std::vector<Guide> find_portals(const Context& context, const Evaluation& evaluation,
                                std::span<const Guide> known, uint64_t seed, const Workers& workers,
                                Progress& progress);

}  // namespace deltalux::gather
