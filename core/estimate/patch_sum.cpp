// SPDX-License-Identifier: Apache-2.0
// Locating a hit takes a hundred times as long as adding it, so only locating is done in parallel.
#include "estimate/patch_sum.h"

namespace deltalux::estimate {

Stats PatchSum::accumulate(const segments::SegmentSpan& segments, int sign, int64_t* sums,
                           const Workers& workers, Progress& progress) const {
  Stats stats;
  const std::vector<uint32_t> patch =
      patches_->landings(segments, workers, progress, &stats.triangle_tests);
  for (size_t i = 0; i < segments.count; ++i) {
    if (patch[i] == kNoTriangle) continue;
    ++stats.hits;
    for (int c = 0; c < 3; ++c)
      sums[3 * size_t(patch[i]) + c] += sign * int64_t(segments.power[3 * i + c]);
  }
  return stats;
}

}  // namespace deltalux::estimate
