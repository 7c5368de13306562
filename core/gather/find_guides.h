// SPDX-License-Identifier: Apache-2.0
// Which places are so bright and small that they want rays of their own.
#pragma once
#include <vector>

#include "base/parallel.h"
#include "base/progress.h"
#include "gather/chain.h"
#include "gather/evaluate.h"
#include "gather/guide.h"

namespace deltalux::gather {

/// Where some rays of a place bring more than the others together, by a few rays of some of the lit
/// cells. `covered`: of Coverage. Whatever it finds, weighted rays bring the same light on the
/// average.
std::vector<Guide> find_guides(const Present& present, const Evaluation& evaluation,
                               std::span<const uint16_t> covered, uint64_t seed,
                               const Workers& workers, Progress& progress);

}  // namespace deltalux::gather
