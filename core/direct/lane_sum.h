// SPDX-License-Identifier: Apache-2.0
// Sums in a fixed order that can be vectorised.
#pragma once
#include <cstddef>

namespace deltalux::direct {

/// Sums in eight lanes, which are then added pairwise.
inline float lane_sum(const float* values, size_t count) {
  float lane[8] = {};
  for (size_t i = 0; i + 8 <= count; i += 8)
    for (size_t k = 0; k < 8; ++k) lane[k] += values[i + k];
  for (size_t i = count / 8 * 8; i < count; ++i) lane[i % 8] += values[i];
  return ((lane[0] + lane[1]) + (lane[2] + lane[3])) + ((lane[4] + lane[5]) + (lane[6] + lane[7]));
}

}  // namespace deltalux::direct
