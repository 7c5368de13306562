// SPDX-License-Identifier: Apache-2.0
// Reorders samples.
#include "samples/sample_set.h"

namespace deltalux::samples {

SampleSet SampleSet::reordered(std::span<const uint32_t> order) const {
  SampleSet out;
  for (uint32_t i : order) {
    out.point.push_back(point[i]);
    out.normal.push_back(normal[i]);
    out.radius.push_back(radius[i]);
    out.attached.push_back(attached[i]);
  }
  return out;
}

}  // namespace deltalux::samples
