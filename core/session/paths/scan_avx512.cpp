// SPDX-License-Identifier: Apache-2.0
// The scan with AVX-512, sixteen segments at a time. It yields the same candidates as the portable
// scan, by the same operations in the same order.
#include "session/paths/scan.h"

#if defined(__AVX512F__)
#include <immintrin.h>

namespace deltalux::session::detail {
namespace {

constexpr uint32_t kGuards = segments::ScanGrid::kGuards;

__mmask16 boxes_meet(__m512i low, __m512i high, const ScanBox& box) {
  const __m512i guards = _mm512_set1_epi32(int(kGuards));
  const __m512i above = _mm512_sub_epi32(_mm512_set1_epi32(int(box.high)), low);
  const __m512i below = _mm512_sub_epi32(high, _mm512_set1_epi32(int(box.low)));
  constexpr int kAllThree = 0x80;
  return _mm512_cmpeq_epi32_mask(_mm512_ternarylogic_epi32(above, below, guards, kAllThree),
                                 guards);
}

/// Lists the indices, from 0, of the segments whose bounding boxes meet one of `boxes`. Free of
/// branches that depend on the data: about half of all groups of sixteen contain a hit, which no
/// predictor could guess.
size_t list_near(const uint32_t* low, const uint32_t* high, size_t count,
                 std::span<const ScanBox> boxes, uint32_t* out) {
  const __m512i clear = _mm512_set1_epi32(int(~kGuards));
  __m512i index = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
  size_t found = 0;
  for (size_t i = 0; i < count; i += 16, index = _mm512_add_epi32(index, _mm512_set1_epi32(16))) {
    const __m512i a = _mm512_and_si512(_mm512_loadu_si512(low + i), clear);
    const __m512i b = _mm512_loadu_si512(high + i);
    __mmask16 meets = 0;
    for (const ScanBox& box : boxes) meets |= boxes_meet(a, b, box);
    _mm512_storeu_si512(out + found, _mm512_maskz_compress_epi32(meets, index));
    found += size_t(__builtin_popcount(meets));
  }
  return found;
}

__m512 field(__m512i word, unsigned at, int mask) {
  return _mm512_cvtepi32_ps(_mm512_and_si512(_mm512_srli_epi32(word, at), _mm512_set1_epi32(mask)));
}

/// Of the segments in the mask `in`, those that the three cross products of the segment's direction
/// with the axes do not separate from the box.
__mmask16 meet_across(__mmask16 in, __m512i low, __m512i high, const ScanBox& box) {
  using segments::ScanGrid;
  const __m512 lx = field(low, 0, 1023), lz = field(low, 11, 1023), ly = field(low, 22, 511);
  const __m512 ux = field(high, 0, 1023), uz = field(high, 11, 1023), uy = field(high, 22, 511);
  const __m512 cx = _mm512_sub_ps(_mm512_add_ps(lx, ux), _mm512_set1_ps(box.centre[0]));
  const __m512 cy = _mm512_sub_ps(_mm512_add_ps(ly, uy), _mm512_set1_ps(box.centre[1]));
  const __m512 cz = _mm512_sub_ps(_mm512_add_ps(lz, uz), _mm512_set1_ps(box.centre[2]));
  const __m512 ax = _mm512_sub_ps(ux, lx), ay = _mm512_sub_ps(uy, ly), az = _mm512_sub_ps(uz, lz);
  const auto fallen = [&](uint32_t bit, __m512 v) {
    const __mmask16 falls = _mm512_test_epi32_mask(low, _mm512_set1_epi32(int(bit)));
    return _mm512_mask_sub_ps(v, falls, _mm512_setzero_ps(), v);
  };
  const __m512 hy = fallen(ScanGrid::kFallsInY, ay), hz = fallen(ScanGrid::kFallsInZ, az);
  const __m512 ex = _mm512_set1_ps(box.half[0]), ey = _mm512_set1_ps(box.half[1]),
               ez = _mm512_set1_ps(box.half[2]);
  const auto overlap = [&](__m512 h1, __m512 c2, __m512 h2, __m512 c1, __m512 e1, __m512 a2,
                           __m512 e2, __m512 a1) {
    const __m512 gap = _mm512_abs_ps(_mm512_sub_ps(_mm512_mul_ps(h1, c2), _mm512_mul_ps(h2, c1)));
    const __m512 reach = _mm512_add_ps(_mm512_mul_ps(e1, a2), _mm512_mul_ps(e2, a1));
    in = _mm512_mask_cmp_ps_mask(in, gap, reach, _CMP_LE_OQ);
  };
  overlap(hy, cz, hz, cy, ey, az, ez, ay);
  overlap(hz, cx, ax, cz, ex, az, ez, ax);
  overlap(ax, cy, hy, cx, ex, ay, ey, ax);
  return in;
}

}  // namespace

size_t scan_avx512(const uint32_t* low, const uint32_t* high, size_t count,
                   std::span<const ScanBox> boxes, uint32_t base, uint32_t* out) {
  // The list is built in place, then compacted towards its front.
  const size_t near = list_near(low, high, count, boxes, out);
  size_t kept = 0;
  for (size_t i = 0; i < near; i += 16) {
    const __mmask16 there = near - i < 16 ? __mmask16((1u << (near - i)) - 1) : __mmask16(0xffff);
    const __m512i index = _mm512_maskz_loadu_epi32(there, out + i);
    const __m512i a = _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), there, index, low, 4);
    const __m512i b = _mm512_mask_i32gather_epi32(_mm512_setzero_si512(), there, index, high, 4);
    const __m512i clear = _mm512_and_si512(a, _mm512_set1_epi32(int(~kGuards)));
    __mmask16 meets = 0;
    for (const ScanBox& box : boxes) meets |= meet_across(boxes_meet(clear, b, box), a, b, box);
    meets &= there;
    _mm512_storeu_si512(out + kept, _mm512_add_epi32(_mm512_set1_epi32(int(base)),
                                                     _mm512_maskz_compress_epi32(meets, index)));
    kept += size_t(__builtin_popcount(meets));
  }
  return kept;
}

}  // namespace deltalux::session::detail
#endif
