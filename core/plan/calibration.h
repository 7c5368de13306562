// SPDX-License-Identifier: Apache-2.0
// Measures the cost of tests on this machine, by small timed searches with known counts.
#pragma once
#include "base/progress.h"
#include "plan/cost_model.h"

namespace deltalux::plan {

/// Runs every method at several array sizes, with discs on walls and in a volume; takes about a
/// second on one processor. Times are CPU times of the calling thread. Throws Cancelled.
Machine calibrate(Progress* progress = nullptr);

}  // namespace deltalux::plan
