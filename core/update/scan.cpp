// SPDX-License-Identifier: Apache-2.0
// Separating axes of segments and boxes: first the boxes' own three, for many at once, then for
// the few that are left those across the segment.
#include "update/scan.h"

#include <cmath>

#include "base/cpu.h"

namespace deltalux::update {

using segments::ScanGrid;

ScanBox scan_box(const segments::ScanGrid& grid, const Box& box) {
  // Ends of outlines are off by half a cell; the rest covers float rounding.
  constexpr float kWiden = 0.55f;
  const Vec3f widen{kWiden, kWiden, kWiden};
  const Vec3f low = grid.to_cells(box.low) - widen, high = grid.to_cells(box.high) + widen;
  ScanBox out;
  out.low = ScanGrid::pack({std::ceil(low.x), std::ceil(low.y), std::ceil(low.z)});
  out.high = ScanGrid::pack({std::floor(high.x), std::floor(high.y), std::floor(high.z)}) |
             ScanGrid::kGuards;
  for (int axis = 0; axis < 3; ++axis) {
    out.centre[axis] = low[axis] + high[axis];
    out.half[axis] = high[axis] - low[axis];
  }
  return out;
}

namespace {

bool boxes_meet(uint32_t low, uint32_t high, const ScanBox& box) {
  constexpr uint32_t kGuards = ScanGrid::kGuards;
  return ((box.high - (low & ~kGuards)) & (high - box.low) & kGuards) == kGuards;
}

/// The three axes across the segment's direction, in half cells.
bool meets_across(uint32_t low, uint32_t high, const ScanBox& box) {
  const auto field = [](uint32_t word, int at, uint32_t mask) { return float(word >> at & mask); };
  const float lx = field(low, 0, 1023), lz = field(low, 11, 1023), ly = field(low, 22, 511);
  const float ux = field(high, 0, 1023), uz = field(high, 11, 1023), uy = field(high, 22, 511);
  const float cx = lx + ux - box.centre[0], cy = ly + uy - box.centre[1],
              cz = lz + uz - box.centre[2];
  const float ax = ux - lx, ay = uy - ly, az = uz - lz;
  const float hy = low & ScanGrid::kFallsInY ? -ay : ay, hz = low & ScanGrid::kFallsInZ ? -az : az;
  const float* e = box.half;
  return std::fabs(hy * cz - hz * cy) <= e[1] * az + e[2] * ay &&
         std::fabs(hz * cx - ax * cz) <= e[0] * az + e[2] * ax &&
         std::fabs(ax * cy - hy * cx) <= e[0] * ay + e[1] * ax;
}

}  // namespace

void scan(const uint32_t* low, const uint32_t* high, size_t count, std::span<const ScanBox> boxes,
          uint32_t base, std::vector<uint32_t>& out) {
#if defined(__x86_64__)
  if (isa() == Isa::avx512) {
    const size_t before = out.size();
    out.resize(before + count + 15);
    out.resize(before + detail::scan_avx512(low, high, count, boxes, base, out.data() + before));
    return;
  }
#endif
  for (size_t i = 0; i < count; i += 16) {
    uint8_t near[16] = {};
    for (const ScanBox& box : boxes)
      for (size_t k = 0; k < 16; ++k) near[k] |= uint8_t(boxes_meet(low[i + k], high[i + k], box));
    for (size_t k = 0; k < 16; ++k) {
      if (!near[k]) continue;
      const uint32_t a = low[i + k], b = high[i + k];
      for (const ScanBox& box : boxes)
        if (boxes_meet(a, b, box) && meets_across(a, b, box)) {
          out.push_back(base + uint32_t(i + k));
          break;
        }
    }
  }
}

}  // namespace deltalux::update
