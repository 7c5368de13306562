// SPDX-License-Identifier: Apache-2.0
// Separating-axis test of segments against boxes: first the three axes of the boxes, for many
// segments at once; then, for the few that are left, the three cross products with the segment's
// direction.
#include "session/paths/scan.h"

#include <algorithm>
#include <cmath>

#include "base/assertion.h"
#include "base/cpu.h"
#include "estimate/lanes.h"

namespace deltalux::session {

using segments::ScanGrid;

ScanBox scan_box(const segments::ScanGrid& grid, const Box& box) {
  DELTALUX_ASSERT(!box.empty());
  // Ends of cell boxes are rounded by up to half a cell; the rest covers rounding of floats.
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

/// Tests the three cross products of the segment's direction with the axes. Coordinates are in half
/// cells.
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

/// Lists the indices, from 0, of the segments whose bounding boxes meet one of `boxes`. May write
/// up to 15 entries more than it returns. Free of branches that depend on the data, which no
/// predictor could guess.
size_t list_near(const uint32_t* low, const uint32_t* high, size_t count,
                 std::span<const ScanBox> boxes, uint32_t* out) {
  size_t found = 0;
  for (size_t i = 0; i < count; i += 16) {
    uint8_t near[16] = {};
    for (const ScanBox& box : boxes)
      for (size_t k = 0; k < 16; ++k) near[k] |= uint8_t(boxes_meet(low[i + k], high[i + k], box));
    for (size_t k = 0; k < 16; ++k) {
      out[found] = uint32_t(i + k);
      found += near[k];
    }
  }
  return found;
}

#if DELTALUX_LANES_AVX2
size_t list_near_avx2(const uint32_t* low, const uint32_t* high, size_t count,
                      std::span<const ScanBox> boxes, uint32_t* out) {
  const auto load = [](const uint32_t* p) {
    return _mm256_loadu_si256(reinterpret_cast<const __m256i*>(p));
  };
  const __m256i guards = _mm256_set1_epi32(int(ScanGrid::kGuards));
  size_t found = 0;
  for (size_t i = 0; i < count; i += 8) {
    const __m256i a = _mm256_andnot_si256(guards, load(low + i)), b = load(high + i);
    __m256i near = _mm256_setzero_si256();
    for (const ScanBox& box : boxes) {
      const __m256i above = _mm256_sub_epi32(_mm256_set1_epi32(int(box.high)), a);
      const __m256i below = _mm256_sub_epi32(b, _mm256_set1_epi32(int(box.low)));
      const __m256i all = _mm256_and_si256(_mm256_and_si256(above, below), guards);
      near = _mm256_or_si256(near, _mm256_cmpeq_epi32(all, guards));
    }
    const auto mask = uint32_t(_mm256_movemask_ps(_mm256_castsi256_ps(near)));
    estimate::lanes::Avx2::store_packed_sequence(out + found, uint32_t(i), mask);
    found += size_t(__builtin_popcount(mask));
  }
  return found;
}
#endif

/// Does what scan() does, in place, without AVX-512; returns the number of candidates. May write up
/// to 15 entries beyond.
size_t scan_eight(const uint32_t* low, const uint32_t* high, size_t count,
                  std::span<const ScanBox> boxes, uint32_t base, uint32_t* out) {
#if DELTALUX_LANES_AVX2
  const auto list = isa() >= Isa::avx2 ? list_near_avx2 : list_near;
#else
  const auto list = list_near;
#endif
  const size_t near = list(low, high, count, boxes, out);
  size_t kept = 0;
  for (size_t i = 0; i < near; ++i) {
    const uint32_t segment = out[i], a = low[segment], b = high[segment];
    out[kept] = base + segment;
    kept += size_t(std::any_of(boxes.begin(), boxes.end(), [&](const ScanBox& box) {
      return boxes_meet(a, b, box) && meets_across(a, b, box);
    }));
  }
  return kept;
}

}  // namespace

void scan(const uint32_t* low, const uint32_t* high, size_t count, std::span<const ScanBox> boxes,
          uint32_t base, std::vector<uint32_t>& out) {
  DELTALUX_ASSERT(count % 16 == 0);
  const size_t before = out.size();
  // The list is built in place, then compacted towards its front.
  out.resize(before + count + 15);
  uint32_t* const place = out.data() + before;
#if defined(__x86_64__)
  const size_t kept = isa() == Isa::avx512
                          ? detail::scan_avx512(low, high, count, boxes, base, place)
                          : scan_eight(low, high, count, boxes, base, place);
#else
  const size_t kept = scan_eight(low, high, count, boxes, base, place);
#endif
  out.resize(before + kept);
}

}  // namespace deltalux::session
