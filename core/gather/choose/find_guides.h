// SPDX-License-Identifier: Apache-2.0
// Chooses places that are so small and bright that gather rays should be sent towards them.
#pragma once
#include "gather/choose/brightness_survey.h"

namespace deltalux::gather {

/// Returns guides for places of which few rays bring more light than all the others. Guides affect
/// noise only: weighted rays have the same expected value.
std::vector<Guide> find_guides(const Context& context, const Evaluation& evaluation,
                               const BrightnessSurvey& survey, Progress& progress);

/// Those guides where a little of a beam's light lands, but not most of it: on a pole that stands
/// in a pool, say. Places that face the pole and not the pool get next to no rays from the beam.
/// `all`: guides found while cells held the light of beams. `known`: other guides, whose places are
/// left out.
std::vector<Guide> find_beside_pools(std::span<const Guide> all, const Beams& beams,
                                     std::span<const Guide> known);

}  // namespace deltalux::gather
