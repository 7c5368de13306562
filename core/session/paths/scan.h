// SPDX-License-Identifier: Apache-2.0
// Scans the 8-byte cell boxes of all segments against boxes and yields candidates for an exact
// test. Measured faster than any search structure over segments.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "segments/segment_store.h"

namespace deltalux::session {

/// A box on the scan's grid, widened by the rounding error of cell boxes.
struct ScanBox {
  uint32_t low, high;  ///< packed as in segments::CellBox: guard bits clear in `low`, set in `high`
  float centre[3], half[3];  ///< in half cells
};

/// Converts a box to the scan's grid.
ScanBox scan_box(const segments::ScanGrid& grid, const Box& box);

/// Appends `base + i` for every i < count whose cell box may meet one of `boxes`. `count` is a
/// multiple of 16.
void scan(const uint32_t* low, const uint32_t* high, size_t count, std::span<const ScanBox> boxes,
          uint32_t base, std::vector<uint32_t>& out);

namespace detail {
/// Does what scan() does; returns the number of candidates. May write up to 15 entries beyond them.
size_t scan_avx512(const uint32_t* low, const uint32_t* high, size_t count,
                   std::span<const ScanBox> boxes, uint32_t base, uint32_t* out);
}  // namespace detail

}  // namespace deltalux::session
