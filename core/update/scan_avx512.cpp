// SPDX-License-Identifier: Apache-2.0
// The scan in AVX-512: sixteen segments at a time. May keep or drop a candidate that the portable
// scan treats otherwise only where the exact test would drop it too.
#include "update/scan.h"

#if defined(__AVX512F__)
#include <immintrin.h>

namespace deltalux::update::detail {
namespace {

constexpr size_t kBlock = 2048;

/// Segments that one of the boxes may meet: outlines and numbers.
struct Near {
  uint32_t centre[kBlock + 16], half[kBlock + 16], index[kBlock + 16];
};

struct Axes {
  __m512 x, y, z;
};

/// Whole cells between which a segment's own interval must reach.
struct Bounds {
  __m512i low[3], high[3];
};

Bounds bounds_of(const ScanBox& box) {
  Bounds b;
  for (int axis = 0; axis < 3; ++axis) {
    const auto whole = [](float v) { return _mm512_cvtps_epi32(_mm512_set1_ps(v)); };
    b.low[axis] = whole(__builtin_ceilf(box.centre[axis] - box.half[axis]));
    b.high[axis] = whole(__builtin_floorf(box.centre[axis] + box.half[axis]));
  }
  return b;
}

__m512i field(__m512i word, int axis) {
  const __m512i ten_bits = _mm512_set1_epi32(1023);
  return axis == 0   ? _mm512_and_si512(word, ten_bits)
         : axis == 1 ? _mm512_and_si512(_mm512_srli_epi32(word, 10), ten_bits)
                     : _mm512_srli_epi32(word, 20);
}

__m512i signed_field(__m512i word, int axis) {
  return _mm512_srai_epi32(
      axis == 0 ? _mm512_slli_epi32(word, 22)
                : axis == 1 ? _mm512_slli_epi32(word, 12) : _mm512_slli_epi32(word, 2),
      22);
}

/// Of one block, those whose own boxes meet. Without branches: about half of all groups of sixteen
/// have one, so that any guess would be wrong half of the time.
size_t meet_boxes(const uint32_t* centre, const uint32_t* half, size_t count,
                  std::span<const Bounds> boxes, uint32_t base, Near& near) {
  __m512i index =
      _mm512_add_epi32(_mm512_set1_epi32(int(base)),
                       _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  size_t found = 0;
  for (size_t i = 0; i < count; i += 16, index = _mm512_add_epi32(index, _mm512_set1_epi32(16))) {
    const __m512i c = _mm512_loadu_si512(centre + i), h = _mm512_loadu_si512(half + i);
    __m512i low[3], high[3];
    for (int axis = 0; axis < 3; ++axis) {
      const __m512i middle = field(c, axis), reach = _mm512_abs_epi32(signed_field(h, axis));
      low[axis] = _mm512_sub_epi32(middle, reach);
      high[axis] = _mm512_add_epi32(middle, reach);
    }
    __mmask16 meets = 0;
    for (const Bounds& b : boxes) {
      __mmask16 both = _mm512_cmple_epi32_mask(low[0], b.high[0]);
      both = _mm512_mask_cmpge_epi32_mask(both, high[0], b.low[0]);
      both = _mm512_mask_cmple_epi32_mask(both, low[1], b.high[1]);
      both = _mm512_mask_cmpge_epi32_mask(both, high[1], b.low[1]);
      both = _mm512_mask_cmple_epi32_mask(both, low[2], b.high[2]);
      both = _mm512_mask_cmpge_epi32_mask(both, high[2], b.low[2]);
      meets |= both;
    }
    _mm512_storeu_si512(near.centre + found, _mm512_maskz_compress_epi32(meets, c));
    _mm512_storeu_si512(near.half + found, _mm512_maskz_compress_epi32(meets, h));
    _mm512_storeu_si512(near.index + found, _mm512_maskz_compress_epi32(meets, index));
    found += size_t(__builtin_popcount(meets));
  }
  return found;
}

/// Sixteen segments against a box along the three axes that stand on segment and box.
__mmask16 meets_across(const ScanBox& box, const Axes& centre, const Axes& half, const Axes& reach) {
  const __m512 ex = _mm512_set1_ps(box.half[0]), ey = _mm512_set1_ps(box.half[1]),
               ez = _mm512_set1_ps(box.half[2]);
  const __m512 cx = _mm512_sub_ps(centre.x, _mm512_set1_ps(box.centre[0]));
  const __m512 cy = _mm512_sub_ps(centre.y, _mm512_set1_ps(box.centre[1]));
  const __m512 cz = _mm512_sub_ps(centre.z, _mm512_set1_ps(box.centre[2]));
  __mmask16 in = _mm512_cmp_ps_mask(_mm512_abs_ps(cx), _mm512_add_ps(ex, reach.x), _CMP_LE_OQ);
  in = _mm512_mask_cmp_ps_mask(in, _mm512_abs_ps(cy), _mm512_add_ps(ey, reach.y), _CMP_LE_OQ);
  in = _mm512_mask_cmp_ps_mask(in, _mm512_abs_ps(cz), _mm512_add_ps(ez, reach.z), _CMP_LE_OQ);
  const auto overlaps = [&](__m512 h1, __m512 c2, __m512 h2, __m512 c1, __m512 e1, __m512 a2,
                            __m512 e2, __m512 a1) {
    const __m512 gap = _mm512_abs_ps(_mm512_fmsub_ps(h1, c2, _mm512_mul_ps(h2, c1)));
    in = _mm512_mask_cmp_ps_mask(in, gap, _mm512_fmadd_ps(e1, a2, _mm512_mul_ps(e2, a1)),
                                 _CMP_LE_OQ);
  };
  overlaps(half.y, cz, half.z, cy, ey, reach.z, ez, reach.y);
  overlaps(half.z, cx, half.x, cz, ez, reach.x, ex, reach.z);
  overlaps(half.x, cy, half.y, cx, ex, reach.y, ey, reach.x);
  return in;
}

}  // namespace

size_t scan_avx512(const uint32_t* centre, const uint32_t* half, size_t count,
                   std::span<const ScanBox> boxes, uint32_t base, uint32_t* out) {
  thread_local Near near;
  uint32_t* const start = out;
  Bounds few[8];
  for (size_t first = 0; first < count; first += kBlock) {
    const size_t block = count - first < kBlock ? count - first : kBlock;
    // Eight boxes at a time would repeat a candidate: more than eight become one that holds them.
    const size_t bounds = boxes.size() < 8 ? boxes.size() : 0;
    for (size_t b = 0; b < bounds; ++b) few[b] = bounds_of(boxes[b]);
    (void)few;
    const size_t found = meet_boxes(centre + first, half + first, block, {few, bounds},
                                    base + uint32_t(first), near);
    for (size_t i = 0; i < found; i += 16) {
      const __m512i c = _mm512_loadu_si512(near.centre + i), h = _mm512_loadu_si512(near.half + i);
      const Axes middle{_mm512_cvtepi32_ps(field(c, 0)), _mm512_cvtepi32_ps(field(c, 1)),
                        _mm512_cvtepi32_ps(field(c, 2))};
      const Axes along{_mm512_cvtepi32_ps(signed_field(h, 0)),
                       _mm512_cvtepi32_ps(signed_field(h, 1)),
                       _mm512_cvtepi32_ps(signed_field(h, 2))};
      const Axes reach{_mm512_abs_ps(along.x), _mm512_abs_ps(along.y), _mm512_abs_ps(along.z)};
      __mmask16 meets = 0;
      for (const ScanBox& box : boxes) meets |= meets_across(box, middle, along, reach);
      if (found - i < 16) meets &= __mmask16((1u << (found - i)) - 1);
      _mm512_storeu_si512(out, _mm512_maskz_compress_epi32(
                                   meets, _mm512_loadu_si512(near.index + i)));
      out += __builtin_popcount(meets);
    }
  }
  return size_t(out - start);
}

}  // namespace deltalux::update::detail
#endif
