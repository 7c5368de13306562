// SPDX-License-Identifier: Apache-2.0
// The scan in AVX-512: sixteen segments at a time. May keep or drop a candidate that the portable
// scan treats otherwise only where the exact test would drop it too.
#include "update/scan.h"

#if defined(__AVX512F__)
#include <immintrin.h>

namespace deltalux::update::detail {

size_t scan_avx512(const uint32_t* centre, const uint32_t* half, size_t count,
                   std::span<const ScanBox> boxes, uint32_t base, uint32_t* out) {
  const __m512i ten_bits = _mm512_set1_epi32(1023);
  __m512i index =
      _mm512_add_epi32(_mm512_set1_epi32(int(base)),
                       _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15));
  const __m512i step = _mm512_set1_epi32(16);
  uint32_t* const start = out;
  for (size_t i = 0; i < count; i += 16, index = _mm512_add_epi32(index, step)) {
    const __m512i c = _mm512_loadu_si512(centre + i), h = _mm512_loadu_si512(half + i);
    const __m512 px = _mm512_cvtepi32_ps(_mm512_and_si512(c, ten_bits));
    const __m512 py = _mm512_cvtepi32_ps(_mm512_and_si512(_mm512_srli_epi32(c, 10), ten_bits));
    const __m512 pz = _mm512_cvtepi32_ps(_mm512_srli_epi32(c, 20));
    const __m512 hx = _mm512_cvtepi32_ps(_mm512_srai_epi32(_mm512_slli_epi32(h, 22), 22));
    const __m512 hy = _mm512_cvtepi32_ps(_mm512_srai_epi32(_mm512_slli_epi32(h, 12), 22));
    const __m512 hz = _mm512_cvtepi32_ps(_mm512_srai_epi32(_mm512_slli_epi32(h, 2), 22));
    const __m512 ax = _mm512_abs_ps(hx), ay = _mm512_abs_ps(hy), az = _mm512_abs_ps(hz);
    __mmask16 meets = 0;
    for (const ScanBox& box : boxes) {
      const __m512 ex = _mm512_set1_ps(box.half[0]), ey = _mm512_set1_ps(box.half[1]),
                   ez = _mm512_set1_ps(box.half[2]);
      const __m512 cx = _mm512_sub_ps(px, _mm512_set1_ps(box.centre[0]));
      const __m512 cy = _mm512_sub_ps(py, _mm512_set1_ps(box.centre[1]));
      const __m512 cz = _mm512_sub_ps(pz, _mm512_set1_ps(box.centre[2]));
      __mmask16 near = _mm512_cmp_ps_mask(_mm512_abs_ps(cx), _mm512_add_ps(ex, ax), _CMP_LE_OQ);
      near = _mm512_mask_cmp_ps_mask(near, _mm512_abs_ps(cy), _mm512_add_ps(ey, ay), _CMP_LE_OQ);
      near = _mm512_mask_cmp_ps_mask(near, _mm512_abs_ps(cz), _mm512_add_ps(ez, az), _CMP_LE_OQ);
      if (!near) continue;
      const auto overlaps = [](__m512 h1, __m512 c2, __m512 h2, __m512 c1, __m512 e1, __m512 a2,
                               __m512 e2, __m512 a1, __mmask16 in) {
        const __m512 gap = _mm512_abs_ps(_mm512_fmsub_ps(h1, c2, _mm512_mul_ps(h2, c1)));
        return _mm512_mask_cmp_ps_mask(in, gap, _mm512_fmadd_ps(e1, a2, _mm512_mul_ps(e2, a1)),
                                       _CMP_LE_OQ);
      };
      near = overlaps(hy, cz, hz, cy, ey, az, ez, ay, near);
      near = overlaps(hz, cx, hx, cz, ex, az, ez, ax, near);
      near = overlaps(hx, cy, hy, cx, ex, ay, ey, ax, near);
      meets |= near;
    }
    if (meets) {
      _mm512_storeu_si512(out, _mm512_maskz_compress_epi32(meets, index));
      out += __builtin_popcount(meets);
    }
  }
  return size_t(out - start);
}

}  // namespace deltalux::update::detail
#endif
