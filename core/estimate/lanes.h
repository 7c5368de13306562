// SPDX-License-Identifier: Apache-2.0
// Operations on eight floats, with or without AVX2. Arithmetic is the same as with single floats,
// so that results are the same. Loops take the implementation as `L`; with() chooses it.
#pragma once
#include <array>
#include <cstdint>

#include "base/cpu.h"

#if defined(__AVX2__) && defined(__FMA__)
#define DELTALUX_LANES_AVX2 1
#include <immintrin.h>
#endif

namespace deltalux::estimate::lanes {

/// order[mask]: the lanes set in `mask`, ascending, one byte each.
inline constexpr auto kOrder = [] {
  std::array<uint64_t, 256> order{};
  for (uint32_t mask = 0; mask < 256; ++mask)
    for (uint32_t lane = 0, place = 0; lane < 8; ++lane)
      if (mask >> lane & 1) order[mask] |= uint64_t(lane) << (8 * place++);
  return order;
}();

/// Portable implementation, which defines the operations.
struct Portable {
  struct Floats {
    float v[8];
    template <class F>
    static Floats each(F&& f) {
      Floats r;
      for (int i = 0; i < 8; ++i) r.v[i] = f(i);
      return r;
    }
    friend Floats operator+(Floats a, Floats b) {
      return each([&](int i) { return a.v[i] + b.v[i]; });
    }
    friend Floats operator-(Floats a, Floats b) {
      return each([&](int i) { return a.v[i] - b.v[i]; });
    }
    friend Floats operator*(Floats a, Floats b) {
      return each([&](int i) { return a.v[i] * b.v[i]; });
    }
    friend Floats operator/(Floats a, Floats b) {
      return each([&](int i) { return a.v[i] / b.v[i]; });
    }
  };
  static Floats load(const float* p) {
    return Floats::each([&](int i) { return p[i]; });
  }
  static Floats broadcast(float x) {
    return Floats::each([&](int) { return x; });
  }
  /// Transposes eight rows of eight floats.
  static void load_columns(const float* const row[8], Floats column[8]) {
    for (int k = 0; k < 8; ++k) column[k] = Floats::each([&](int i) { return row[i][k]; });
  }
  /// Returns b if either is NaN; so does max().
  static Floats min(Floats a, Floats b) {
    return Floats::each([&](int i) { return a.v[i] < b.v[i] ? a.v[i] : b.v[i]; });
  }
  static Floats max(Floats a, Floats b) {
    return Floats::each([&](int i) { return a.v[i] > b.v[i] ? a.v[i] : b.v[i]; });
  }
  /// Rounded once or twice, depending on the implementation: not for results.
  static Floats about_multiply_subtract(Floats a, Floats b, Floats c) { return a * b - c; }
  static Floats about_multiply_add(Floats a, Floats b, Floats c) { return a * b + c; }
  static Floats about_less_product(Floats c, Floats a, Floats b) { return c - a * b; }
  using Flags = uint32_t;
  static Flags less(Floats a, Floats b) {
    Flags r = 0;
    for (int i = 0; i < 8; ++i) r |= Flags(a.v[i] < b.v[i]) << i;
    return r;
  }
  static Flags less_equal(Floats a, Floats b) {
    Flags r = 0;
    for (int i = 0; i < 8; ++i) r |= Flags(a.v[i] <= b.v[i]) << i;
    return r;
  }
  static Flags both(Flags a, Flags b) { return a & b; }
  static uint32_t mask(Flags f) { return f; }
  /// Writes the values of the lanes set in `mask` contiguously; the rest of the eight places gets
  /// arbitrary values.
  static void store_packed(uint32_t* to, const uint32_t* values, uint32_t mask) {
    for (int i = 0; i < 8; ++i) to[i] = values[kOrder[mask] >> (8 * i) & 7];
  }
  static void store_packed(float* to, Floats values, uint32_t mask) {
    for (int i = 0; i < 8; ++i) to[i] = values.v[kOrder[mask] >> (8 * i) & 7];
  }
  /// The same for the values base, base + 1, ...
  static void store_packed_sequence(uint32_t* to, uint32_t base, uint32_t mask) {
    for (int i = 0; i < 8; ++i) to[i] = base + uint32_t(kOrder[mask] >> (8 * i) & 7);
  }
  static void store_all(uint32_t* to, uint32_t value) {
    for (int i = 0; i < 8; ++i) to[i] = value;
  }
};

#if DELTALUX_LANES_AVX2
struct Avx2 {
  using Floats = __m256;
  static Floats load(const float* p) { return _mm256_load_ps(p); }
  static Floats broadcast(float x) { return _mm256_set1_ps(x); }
  static void load_columns(const float* const row[8], Floats column[8]) {
    __m256 pair[8], quad[8];
    for (int i = 0; i < 8; i += 2) {
      const __m256 a = load(row[i]), b = load(row[i + 1]);
      pair[i] = _mm256_unpacklo_ps(a, b), pair[i + 1] = _mm256_unpackhi_ps(a, b);
    }
    for (int i = 0; i < 8; i += 4)
      for (int k = 0; k < 2; ++k) {
        quad[i + 2 * k] = _mm256_shuffle_ps(pair[i + k], pair[i + k + 2], 0x44);
        quad[i + 2 * k + 1] = _mm256_shuffle_ps(pair[i + k], pair[i + k + 2], 0xee);
      }
    for (int k = 0; k < 4; ++k) {
      column[k] = _mm256_permute2f128_ps(quad[k], quad[k + 4], 0x20);
      column[k + 4] = _mm256_permute2f128_ps(quad[k], quad[k + 4], 0x31);
    }
  }
  static Floats min(Floats a, Floats b) { return _mm256_min_ps(a, b); }
  static Floats max(Floats a, Floats b) { return _mm256_max_ps(a, b); }
  static Floats about_multiply_subtract(Floats a, Floats b, Floats c) {
    return _mm256_fmsub_ps(a, b, c);
  }
  static Floats about_multiply_add(Floats a, Floats b, Floats c) {
    return _mm256_fmadd_ps(a, b, c);
  }
  static Floats about_less_product(Floats c, Floats a, Floats b) {
    return _mm256_fnmadd_ps(a, b, c);
  }
  using Flags = __m256;
  static Flags less(Floats a, Floats b) { return _mm256_cmp_ps(a, b, _CMP_LT_OQ); }
  static Flags less_equal(Floats a, Floats b) { return _mm256_cmp_ps(a, b, _CMP_LE_OQ); }
  static Flags both(Flags a, Flags b) { return _mm256_and_ps(a, b); }
  static uint32_t mask(Flags f) { return uint32_t(_mm256_movemask_ps(f)); }

  static void store_packed(uint32_t* to, __m256i values, uint32_t mask) {
    const __m128i order = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(&kOrder[mask]));
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to),
                        _mm256_permutevar8x32_epi32(values, _mm256_cvtepu8_epi32(order)));
  }
  static void store_packed(uint32_t* to, const uint32_t* values, uint32_t mask) {
    store_packed(to, _mm256_load_si256(reinterpret_cast<const __m256i*>(values)), mask);
  }
  static void store_packed(float* to, Floats values, uint32_t mask) {
    const __m128i order = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(&kOrder[mask]));
    _mm256_storeu_ps(to, _mm256_permutevar8x32_ps(values, _mm256_cvtepu8_epi32(order)));
  }
  static void store_packed_sequence(uint32_t* to, uint32_t base, uint32_t mask) {
    const __m256i count = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    store_packed(to, _mm256_add_epi32(_mm256_set1_epi32(int(base)), count), mask);
  }
  static void store_all(uint32_t* to, uint32_t value) {
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(to), _mm256_set1_epi32(int(value)));
  }
};
#endif

/// Calls `f` with the best implementation that isa() allows.
template <class F>
decltype(auto) with(F&& f) {
#if DELTALUX_LANES_AVX2
  if (isa() >= Isa::avx2) return f(Avx2());
#endif
  return f(Portable());
}

}  // namespace deltalux::estimate::lanes
