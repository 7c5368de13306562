// SPDX-License-Identifier: Apache-2.0
// Makes the disc methods that a plan can choose.
#pragma once
#include <memory>

#include "base/parallel.h"
#include "base/progress.h"
#include "estimate/estimator.h"
#include "plan/cost_model.h"

namespace deltalux::plan {

/// `automatic` means the disc index. Throws Cancelled, and OptionError for discs that are not
/// finite.
std::unique_ptr<estimate::SignedEstimator> make_estimator(Method method, samples::DiscSet discs,
                                                          segments::SegmentEnd rule,
                                                          const Workers& workers,
                                                          Progress* progress);

}  // namespace deltalux::plan
