// SPDX-License-Identifier: Apache-2.0
// Scan of all segments' 8-byte outlines against boxes: finds candidates for an exact test
// (SYSTEM.md section 5: a scan beat every search structure).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "base/vec.h"
#include "segments/segment_store.h"

namespace deltalux::update {

/// A box on the scan's grid, widened by the rounding of the outlines.
struct ScanBox {
  float centre[3], half[3];
};

ScanBox scan_box(const segments::ScanGrid& grid, const Box& box);

/// Appends `base + i` for every i < count whose outline may meet one of `boxes`. `count` is a
/// multiple of 16.
void scan(const uint32_t* centre, const uint32_t* half, size_t count,
          std::span<const ScanBox> boxes, uint32_t base, std::vector<uint32_t>& out);

namespace detail {
size_t scan_avx512(const uint32_t* centre, const uint32_t* half, size_t count,
                   std::span<const ScanBox> boxes, uint32_t base, uint32_t* out);
}

}  // namespace deltalux::update
