// SPDX-License-Identifier: Apache-2.0
// Separating-axis test of segments and boxes, written so that compilers vectorise it.
#include "update/scan.h"

#include <cmath>

namespace deltalux::update {

ScanBox scan_box(const segments::ScanGrid& grid, const Box& box) {
  ScanBox out;
  const Vec3f centre = (box.centre() - grid.origin) * grid.cells_per_metre;
  const Vec3f half = box.extent() * (0.5f * grid.cells_per_metre);
  for (int axis = 0; axis < 3; ++axis) {
    out.centre[axis] = centre[axis];
    // Centre and half extent are each off by half a cell; the rest covers float rounding.
    out.half[axis] = half[axis] + 1.05f;
  }
  return out;
}

namespace {

void test_block(const uint32_t* centre, const uint32_t* half, const ScanBox& box,
                uint8_t* __restrict meets) {
  constexpr int kBlock = 16;
  for (int i = 0; i < kBlock; ++i) {
    const uint32_t c = centre[i], h = half[i];
    const float cx = float(int32_t(c & 1023u)) - box.centre[0];
    const float cy = float(int32_t(c >> 10 & 1023u)) - box.centre[1];
    const float cz = float(int32_t(c >> 20 & 1023u)) - box.centre[2];
    const float hx = float(int32_t(h << 22) >> 22), hy = float(int32_t(h << 12) >> 22),
                hz = float(int32_t(h << 2) >> 22);
    const float ax = std::fabs(hx), ay = std::fabs(hy), az = std::fabs(hz);
    const float* e = box.half;
    const bool apart = (std::fabs(cx) > e[0] + ax) | (std::fabs(cy) > e[1] + ay) |
                       (std::fabs(cz) > e[2] + az) |
                       (std::fabs(hy * cz - hz * cy) > e[1] * az + e[2] * ay) |
                       (std::fabs(hz * cx - hx * cz) > e[0] * az + e[2] * ax) |
                       (std::fabs(hx * cy - hy * cx) > e[0] * ay + e[1] * ax);
    meets[i] |= uint8_t(!apart);
  }
}

}  // namespace

void scan(const uint32_t* centre, const uint32_t* half, size_t count,
          std::span<const ScanBox> boxes, uint32_t base, std::vector<uint32_t>& out) {
#if defined(__x86_64__)
  static const bool wide = __builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512dq");
  if (wide) {
    const size_t before = out.size();
    out.resize(before + count);
    out.resize(before + detail::scan_avx512(centre, half, count, boxes, base, out.data() + before));
    return;
  }
#endif
  for (size_t i = 0; i < count; i += 16) {
    uint8_t meets[16] = {};
    for (const ScanBox& box : boxes) test_block(centre + i, half + i, box, meets);
    for (int k = 0; k < 16; ++k)
      if (meets[k]) out.push_back(base + uint32_t(i) + k);
  }
}

}  // namespace deltalux::update
