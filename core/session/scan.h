// SPDX-License-Identifier: Apache-2.0
// Scan of all segments' 8-byte cell boxes against boxes: finds candidates for an exact test.
// Measured faster than any search structure over segments.
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "segments/segment_store.h"

namespace deltalux::session {

/// A box on the scan's grid, widened by the rounding of cell boxes.
struct ScanBox {
  uint32_t low, high;        ///< as in segments::CellBox, both with guards clear or set alike
  float centre[3], half[3];  ///< in half cells
};

ScanBox scan_box(const segments::ScanGrid& grid, const Box& box);

/// Appends `base + i` for every i < count whose cell box may meet one of `boxes`. `count` is a
/// multiple of 16.
void scan(const uint32_t* low, const uint32_t* high, size_t count, std::span<const ScanBox> boxes,
          uint32_t base, std::vector<uint32_t>& out);

namespace detail {
/// Writes at most `count` numbers, and may use 15 more places behind them.
size_t scan_avx512(const uint32_t* low, const uint32_t* high, size_t count,
                   std::span<const ScanBox> boxes, uint32_t base, uint32_t* out);
}  // namespace detail

}  // namespace deltalux::session
