// SPDX-License-Identifier: Apache-2.0
// The disc methods that a session can run on; all of them give the same sums.
#pragma once
#include <memory>

#include "base/parallel.h"
#include "base/progress.h"
#include "estimate/estimator.h"

namespace deltalux::update {

enum class Method : uint8_t { automatic, brute_force, disc_index, ray_map, sphere_cache };

/// Throws Cancelled, and OptionError for discs that are not finite.
std::unique_ptr<estimate::SignedEstimator> make_estimator(Method method, samples::DiscSet discs,
                                                          segments::SegmentEnd rule,
                                                          const Workers& workers,
                                                          Progress& progress);

}  // namespace deltalux::update
