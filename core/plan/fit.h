// SPDX-License-Identifier: Apache-2.0
// Constants that explain measured times: least squares of the relative errors, held to a prior.
#pragma once
#include <span>

#include "plan/cost_model.h"

namespace deltalux::plan {

/// One timed search.
struct Timed {
  Counts counts{};
  double seconds = 0;
};

/// Constants x > 0 that minimise sum (counts · x / seconds - 1)² + kHold · sum (x / prior - 1)²,
/// the prior first scaled to the median of the measured speeds. A few searches cannot tell all
/// kinds of tests apart: what they leave open stays in the prior's proportions. `prior` may hold
/// zeros, for counts that the method does not have.
Counts fit_constants(std::span<const Timed> searches, const Counts& prior);

}  // namespace deltalux::plan
