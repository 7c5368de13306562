// SPDX-License-Identifier: Apache-2.0
// Chooses places that are so small and bright that gather rays should be sent towards them.
#pragma once
#include "gather/choose/brightness_survey.h"

namespace deltalux::gather {

/// Returns guides for places of which few rays bring more light than all the others. Guides affect
/// noise only: weighted rays have the same expected value.
std::vector<Guide> find_guides(const Present& present, const Evaluation& evaluation,
                               const BrightnessSurvey& survey, Progress& progress);

}  // namespace deltalux::gather
