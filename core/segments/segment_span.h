// SPDX-License-Identifier: Apache-2.0
// Segments as estimators see them: views of structures of arrays, from a store or from a user.
#pragma once
#include <cstddef>
#include <cstdint>

namespace deltalux::segments {

/// Which part of a segment counts (paper 2.1; docs/explanation/segment-ends.md).
enum class SegmentEnd : uint8_t {
  first,    ///< up to the first hit
  second,   ///< up to the second hit
  bounded,  ///< up to the second hit, at most kBoundedRadii disc radii beyond the first
};
inline constexpr float kBoundedRadii = 3.0f;

/// `count` segments. `power` holds 3 quanta per segment; `slab` is the index of the sums
/// (EnergySums) that a segment adds to, null = slab 0 for all. `extended` may equal `length`.
struct SegmentSpan {
  size_t count = 0;
  const float *ox = nullptr, *oy = nullptr, *oz = nullptr;
  const float *dx = nullptr, *dy = nullptr, *dz = nullptr;
  const float *length = nullptr, *extended = nullptr;
  const uint32_t* power = nullptr;
  const uint16_t* slab = nullptr;
};

}  // namespace deltalux::segments
