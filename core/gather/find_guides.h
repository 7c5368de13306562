// SPDX-License-Identifier: Apache-2.0
// Which places are so bright and small that they want rays of their own.
#pragma once
#include "gather/votes.h"

namespace deltalux::gather {

/// Where some rays of a place bring more than the others together. Whatever it finds, weighted rays
/// bring the same light on the average.
std::vector<Guide> find_guides(const Present& present, const Evaluation& evaluation,
                               const Votes& votes, Progress& progress);

}  // namespace deltalux::gather
