// SPDX-License-Identifier: Apache-2.0
// Fits constants to measured times: least squares of the relative errors, regularised by a prior.
#pragma once
#include <span>

#include "plan/cost_model.h"

namespace deltalux::plan {

/// One timed search.
struct Timed {
  Counts counts{};
  double seconds = 0;
};

/// Returns the constants x > 0 that minimise sum (counts · x / seconds - 1)² + kHold · sum (x /
/// prior - 1)², where the prior is first scaled to the median of the measured speeds. A few
/// searches cannot distinguish all kinds of tests: undetermined combinations keep the prior's
/// proportions. `prior` may contain zeros, for counts that the method does not have.
Counts fit_constants(std::span<const Timed> searches, const Counts& prior);

}  // namespace deltalux::plan
