// SPDX-License-Identifier: Apache-2.0
// What a test costs on this machine: small searches of known counts, timed.
#pragma once
#include "base/progress.h"
#include "plan/cost_model.h"

namespace deltalux::plan {

/// Runs every method at several array sizes, on discs on walls and in a volume; about a second of
/// one processor. Times are those of the calling thread. Throws Cancelled.
Machine calibrate(Progress* progress = nullptr);

}  // namespace deltalux::plan
