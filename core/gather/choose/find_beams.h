// SPDX-License-Identifier: Apache-2.0
// Chooses the narrow spots that light so small a place that gather rays should be sent towards it.
#pragma once
#include "gather/choose/brightness_survey.h"

namespace deltalux::gather {

/// Returns the spots whose light stands out for most places that see where it lands. `survey`: for
/// cells that hold all light.
std::vector<BeamGuide> find_beams(const Context& context, const Evaluation& evaluation,
                                  const BrightnessSurvey& survey, uint64_t seed);

}  // namespace deltalux::gather
